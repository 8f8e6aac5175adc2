//! What the user sees: results on standard output, findings and progress on standard error.

use std::cell::{Cell, RefCell};
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::{Value, json};

use crate::diagnostic::{self, Diagnostic};
use crate::outcome::{ENVIRONMENT, Failure, Outcome};
use crate::shell;
use crate::source::SpecSource;

/// Delay before a progress line is shown.
const PROGRESS_DELAY: Duration = Duration::from_millis(800);
/// Which controller a command runs on this computer: both have the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerForm {
    /// The law on the constants of the compiled spec; nothing is built.
    RunTime,
    /// The emitted crate, built as a library.
    Emitted,
}

/// Output in one of two forms.
pub struct Ui {
    json: bool,
    controller: Cell<Option<ControllerForm>>,
    findings: Vec<Value>,
    /// Reason why standard output is incomplete.
    lost: RefCell<Option<io::Error>>,
    /// The program that called the command.
    caller: Option<Caller>,
}

/// A message of a command to the program that called it.
#[derive(Debug)]
pub enum Message<'a> {
    /// A line about what is being done.
    Progress(&'a str),
    /// Answers to a line of commands: an array of objects with `command` and `answer`.
    Answers(Value),
}

/// A program that called a command.
struct Caller {
    listener: Box<dyn Fn(Message<'_>)>,
    /// Lines of a session, instead of standard input.
    lines: Option<Receiver<String>>,
    /// The document, which is not printed.
    document: RefCell<Value>,
}

/// Writes to standard error. A message that cannot be written, on a full disk say, is no reason to end.
macro_rules! say {
    ($($text:tt)*) => {
        let _ = write!(anstream::stderr(), $($text)*);
    };
}

impl Ui {
    /// Text, or one JSON document at the end.
    pub fn new(json: bool) -> Self {
        Self { json, controller: Cell::new(None), findings: Vec::new(), lost: RefCell::new(None), caller: None }
    }

    /// One document, which [`Ui::into_document`] returns; `listener` gets the progress. Nothing is printed.
    pub fn called(listener: impl Fn(Message<'_>) + 'static, lines: Option<Receiver<String>>) -> Self {
        let document = RefCell::new(Value::Null);
        Self { caller: Some(Caller { listener: Box::new(listener), lines, document }), ..Self::new(true) }
    }

    /// The lines of a session, if a program gives them.
    pub fn take_lines(&mut self) -> Option<Receiver<String>> {
        self.caller.as_mut()?.lines.take()
    }

    /// Hands the answers to a line of commands to the program that gave it; without one they are kept for the document.
    pub fn answered(&self, answers: &mut Vec<impl Serialize>) {
        if let Some(caller) = &self.caller {
            (caller.listener)(Message::Answers(json!(answers)));
            answers.clear();
        }
    }

    /// The document of a command that another program called.
    pub fn into_document(self) -> Value {
        self.caller.map_or(Value::Null, |caller| caller.document.into_inner())
    }

    /// A line about what is being done, for the eyes only.
    pub fn progress(&self, line: &str) {
        if let Some(caller) = &self.caller {
            (caller.listener)(Message::Progress(line));
        } else if !self.json {
            say!("{line}\n");
        }
    }

    /// Notes for the document which controller runs.
    pub fn runs(&self, controller: ControllerForm) {
        self.controller.set(Some(controller));
    }

    /// Does `work`; at a terminal a line says what it is and for how long, once it takes longer than a glance.
    pub fn during<T>(&self, what: &str, work: impl FnOnce() -> T) -> T {
        if self.json || !self.is_terminal() {
            return work();
        }
        let (done, waits) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                let begun = Instant::now();
                let mut shown = false;
                while let Err(RecvTimeoutError::Timeout) = waits.recv_timeout(PROGRESS_DELAY) {
                    shown = true;
                    say!("\r\x1b[2K{what}: {:.0} s", begun.elapsed().as_secs_f64());
                }
                if shown {
                    say!("\r\x1b[2K");
                }
            });
            let made = work();
            drop(done);
            made
        })
    }

    /// Shows findings now (text) or keeps them for the document (JSON).
    pub fn findings(&mut self, source: Option<&SpecSource>, findings: &[Diagnostic]) {
        if findings.is_empty() {
            return;
        }
        // Findings about data files need no spec to point into.
        let nothing = SpecSource { display_name: String::new(), text: String::new(), dir: PathBuf::new() };
        let source = source.unwrap_or(&nothing);
        if self.json {
            if let Value::Array(list) = diagnostic::to_json(findings, source) {
                self.findings.extend(list);
            }
        } else {
            let color = io::stderr().is_terminal();
            say!("{}", diagnostic::render(findings, source, color));
        }
    }

    /// Findings of a spec that a command only looks things up in, for people in one line.
    pub fn findings_in_brief(&mut self, source: &SpecSource, findings: &[Diagnostic]) {
        if self.json {
            self.findings(Some(source), findings);
        } else if !findings.is_empty() {
            let (count, s) = (findings.len(), if findings.len() == 1 { "" } else { "s" });
            let check = shell::on("specgen check", &source.display_name, "");
            say!("{}: {count} finding{s}, shown by `{check}`\n", source.display_name);
        }
    }

    /// The result of a command that succeeded.
    pub fn result(&self, outcome: &impl Outcome) {
        if self.json {
            self.document(0, json!(outcome), None);
        } else {
            self.out(&outcome.text());
        }
    }

    /// The result of a command, and the failure to return if there is a reason why it does not pass.
    ///
    /// # Errors
    /// [`Failure::Judged`] with the message, if there is one.
    pub fn judged(&self, outcome: &impl Outcome, failed: Option<String>) -> Result<(), Failure> {
        match failed {
            None => {
                self.result(outcome);
                Ok(())
            }
            Some(message) => Err(Failure::Judged { message, result: self.shown(outcome) }),
        }
    }

    /// The result of simulated runs, and the failure to return if some, by their names, did not come to the end of their path.
    ///
    /// # Errors
    /// [`Failure::EndedEarly`], if there is a name.
    pub fn scored(&self, outcome: &impl Outcome, ended: &[String]) -> Result<(), Failure> {
        if ended.is_empty() {
            self.result(outcome);
            return Ok(());
        }
        let message = format!("ended before the end of the path, so there is no figure: {}", ended.join(", "));
        Err(Failure::EndedEarly { message, result: self.shown(outcome) })
    }

    /// The result of a command that fails: its text goes out now, and the value is for the failure.
    pub fn shown(&self, outcome: &impl Outcome) -> Value {
        if !self.json {
            self.out(&outcome.text());
        }
        json!(outcome)
    }

    /// Shows how far something is, in place of the line before where the eyes are at a terminal.
    pub fn rate(&self, line: &str) {
        if let Some(caller) = &self.caller {
            (caller.listener)(Message::Progress(line));
        } else if !self.json {
            if io::stderr().is_terminal() {
                say!("\r\x1b[2K{line}");
            } else {
                say!("{line}\n");
            }
        }
    }

    /// Ends the line of [`Ui::rate`].
    pub fn rate_done(&self) {
        if !self.json && io::stderr().is_terminal() {
            say!("\n");
        }
    }

    /// Whether standard error is a terminal, or a program takes every line that would be shown at one.
    pub fn is_terminal(&self) -> bool {
        self.caller.is_some() || io::stderr().is_terminal()
    }

    /// Whether the result is for programs.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Plain text on standard output. A closed pipe is the reader's business, not an error of ours.
    pub fn out(&self, text: &str) {
        let mut stdout = io::stdout();
        self.keep_lost(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()));
    }

    fn keep_lost(&self, written: io::Result<()>) {
        if let Err(error) = written
            && error.kind() != io::ErrorKind::BrokenPipe
        {
            self.lost.borrow_mut().get_or_insert(error);
        }
    }

    /// The same for a text with colours, which only a terminal shows.
    pub fn styled(&self, text: &str) {
        let mut stdout = anstream::stdout();
        self.keep_lost(write!(stdout, "{text}").and_then(|()| stdout.flush()));
    }

    /// Says so and gives the exit code if standard output did not take all that was written to it.
    pub fn not_all_out(&self) -> Option<u8> {
        let error = self.lost.take()?;
        say!("error: could not write to standard output: {error}; the output is incomplete\n");
        Some(ENVIRONMENT)
    }

    /// Reports a failure; returns the exit code.
    pub fn failed(&mut self, failure: &Failure) -> u8 {
        if let Failure::Refused(refused) = failure {
            self.findings(refused.source.as_ref(), &refused.findings);
        }
        let (code, message) = (failure.exit_code(), failure.message());
        if self.json {
            self.document(code, failure.result(), Some(&message));
        } else {
            say!("error: {message}\n");
        }
        code
    }

    fn document(&self, exit_code: u8, result: Value, error: Option<&str>) {
        let document = json!({
            "specgen": env!("CARGO_PKG_VERSION"),
            "exit_code": exit_code,
            "error": error,
            "controller": self.controller.get(),
            "findings": self.findings,
            "result": result,
        });
        match &self.caller {
            Some(caller) => *caller.document.borrow_mut() = document,
            None => self.out(&format!("{document:#}\n")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::ENDED_EARLY;

    #[test]
    fn runs_that_ended_early_have_a_message_and_an_exit_code_of_their_own() {
        #[derive(Serialize)]
        struct Figures(u32);

        impl Outcome for Figures {
            fn text(&self) -> String {
                String::new()
            }
        }

        let mut ui = Ui::called(|_| (), None);
        assert!(ui.scored(&Figures(3), &[]).is_ok());
        let failure = ui.scored(&Figures(3), &["line".to_owned()]).unwrap_err();
        assert_eq!(ui.failed(&failure), ENDED_EARLY);
        let document = ui.into_document();
        assert_eq!(document["result"], json!(3));
        assert!(document["error"].as_str().is_some_and(|text| text.ends_with("no figure: line")), "{document:#}");
    }
}
