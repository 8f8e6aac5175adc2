//! What the user sees: results on standard output, findings and progress on standard error.

use std::cell::{Cell, RefCell};
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use host_sim::closed_loop::RunError;
use serde::Serialize;
use serde_json::{Value, json};

use specgen_compiler::compile::Refused;
use specgen_compiler::workspace::WriteError;
use specgen_language::diagnostic::{self, Diagnostic, Place, Severity};
use specgen_language::shell;
use specgen_language::spec::SpecSource;
use specgen_toolchain::TargetError;

/// Whatever takes longer than this is said to be under way.
const GLANCE: Duration = Duration::from_millis(800);
/// Exit code where the machine is to blame: a tool, a disk.
const ENVIRONMENT: u8 = 3;
/// Exit code of a simulated run that did not come to the end of its path.
const ENDED_EARLY: u8 = 4;
/// Exit code of a command that was ended by Ctrl-C, as shells have it.
const INTERRUPTED: u8 = 130;

/// Why a command did not succeed, by exit code.
#[derive(Debug)]
pub enum Failure {
    /// The spec or a record is refused.
    Refused(Box<Refused>),
    /// A declared budget is exceeded, a comparison failed: exit code 1, in words.
    Gate(String),
    /// Arguments that make no sense together.
    Usage(String),
    /// The output could not be written.
    Write(WriteError),
    /// A tool is missing or failed.
    Target(TargetError),
    /// The file system or the simulator said no.
    Environment(String),
    /// A gate is not passed, with the figures that say why: exit code 1.
    Judged {
        message: String,
        /// For programs; the text is out already.
        result: Value,
    },
    /// What this machine lacks or a tool refuses, after a part of the work is done: exit code 3, with that part.
    Incomplete {
        message: String,
        /// For programs; the text is out already.
        result: Value,
    },
    /// A run did not come to the end of its path, so that it has no figure: exit code 4, with the figures of the others.
    EndedEarly {
        message: String,
        /// For programs; the text is out already.
        result: Value,
    },
    /// Ended from outside with a result: what was found so far.
    Interrupted {
        message: String,
        /// For programs; the text is out already.
        result: Value,
    },
}

impl Failure {
    /// Ended by Ctrl-C before there was a result.
    pub fn interrupted() -> Self {
        let message = "interrupted: there is no result; every file that is there is whole".to_owned();
        Self::Interrupted { message, result: Value::Null }
    }
}

impl From<Refused> for Failure {
    fn from(refused: Refused) -> Self {
        Self::Refused(Box::new(refused))
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        let message = error.to_string();
        match error {
            RunError::EndedEarly { .. } | RunError::NotEnded { .. } => {
                Self::EndedEarly { message, result: Value::Null }
            }
            _ => Self::Environment(message),
        }
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::Write(error)
    }
}

impl From<TargetError> for Failure {
    fn from(error: TargetError) -> Self {
        Self::Target(error)
    }
}

/// What a command found: the one value of which both forms are made. The document has its fields.
pub trait Outcome: Serialize {
    /// The text, whole lines.
    fn text(&self) -> String;
}

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
    /// Why standard output is not whole.
    lost: RefCell<Option<io::Error>>,
    /// Of a command that another program called.
    called: Option<Called>,
}

/// What a command says on its way to a program that called it.
#[derive(Debug)]
pub enum Said<'a> {
    /// A line about what is being done.
    Progress(&'a str),
    /// Answers to a line of orders: an array of objects with `command` and `answer`.
    Answers(Value),
}

/// Where a command's words go when another program called it.
struct Called {
    hear: Box<dyn Fn(Said<'_>)>,
    /// Lines of a session, in place of standard input.
    orders: Option<Receiver<String>>,
    /// What would be printed.
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
        Self { json, controller: Cell::new(None), findings: Vec::new(), lost: RefCell::new(None), called: None }
    }

    /// One document, which is kept for [`Ui::taken`]; `hear` is told of the progress. Nothing is printed.
    pub fn called(hear: impl Fn(Said<'_>) + 'static, orders: Option<Receiver<String>>) -> Self {
        let document = RefCell::new(Value::Null);
        Self { called: Some(Called { hear: Box::new(hear), orders, document }), ..Self::new(true) }
    }

    /// Where the lines of a session come from, if a program gives them.
    pub fn orders(&mut self) -> Option<Receiver<String>> {
        self.called.as_mut()?.orders.take()
    }

    /// Hands the answers to a line of orders to the program that gave it; without one they are kept for the document.
    pub fn answered(&self, answers: &mut Vec<impl Serialize>) {
        if let Some(called) = &self.called {
            (called.hear)(Said::Answers(json!(answers)));
            answers.clear();
        }
    }

    /// The document of a command that another program called.
    pub fn taken(self) -> Value {
        self.called.map_or(Value::Null, |called| called.document.into_inner())
    }

    /// A line about what is being done, for the eyes only.
    pub fn progress(&self, line: &str) {
        if let Some(called) = &self.called {
            (called.hear)(Said::Progress(line));
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
                while let Err(RecvTimeoutError::Timeout) = waits.recv_timeout(GLANCE) {
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
    pub fn scored(&self, outcome: &impl Outcome, ended: &[String]) -> Result<(), Failure> {
        if ended.is_empty() {
            self.result(outcome);
            return Ok(());
        }
        let message = format!("ended before the end of the path, so that there is no figure: {}", ended.join(", "));
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
        if let Some(called) = &self.called {
            (called.hear)(Said::Progress(line));
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
        self.called.is_some() || io::stderr().is_terminal()
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
    pub fn styled(&self, text: &clap::builder::StyledStr) {
        let mut stdout = anstream::stdout();
        self.keep_lost(write!(stdout, "{}", text.ansi()).and_then(|()| stdout.flush()));
    }

    /// Says so and gives the exit code if standard output did not take all that was written to it.
    pub fn not_all_out(&self) -> Option<u8> {
        let error = self.lost.take()?;
        say!("error: could not write to standard output: {error}; what is there of it is not whole\n");
        Some(ENVIRONMENT)
    }

    /// Reports a failure; returns the exit code.
    pub fn failed(&mut self, failure: &Failure) -> u8 {
        let (code, message) = match failure {
            Failure::Refused(refused) => {
                self.findings(refused.source.as_ref(), &refused.findings);
                (1, format!("{} is refused; nothing was written", refused_file(refused)))
            }
            Failure::Gate(text) => (1, text.clone()),
            Failure::Usage(text) => (2, text.clone()),
            Failure::Write(error @ (WriteError::Occupied { .. } | WriteError::NotAFolder { .. })) => {
                (1, error.to_string())
            }
            Failure::Write(error) => (ENVIRONMENT, error.to_string()),
            Failure::Target(error) => (ENVIRONMENT, error.to_string()),
            Failure::Environment(text) => (ENVIRONMENT, text.clone()),
            Failure::Judged { message, .. } => (1, message.clone()),
            Failure::Incomplete { message, .. } => (ENVIRONMENT, message.clone()),
            Failure::EndedEarly { message, .. } => (ENDED_EARLY, message.clone()),
            Failure::Interrupted { message, .. } => (INTERRUPTED, message.clone()),
        };
        if self.json {
            let result = match failure {
                Failure::Interrupted { result, .. }
                | Failure::Judged { result, .. }
                | Failure::EndedEarly { result, .. }
                | Failure::Incomplete { result, .. } => result.clone(),
                _ => Value::Null,
            };
            self.document(code, result, Some(&message));
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
        match &self.called {
            Some(called) => *called.document.borrow_mut() = document,
            None => self.out(&format!("{document:#}\n")),
        }
    }
}

/// The file that is to blame, as its user named it. A spec that names a bad record is refused itself.
fn refused_file(refused: &Refused) -> &str {
    if let Some(source) = &refused.source {
        return &source.display_name;
    }
    let first = refused.findings.iter().find(|finding| finding.severity == Severity::Error);
    match first.map(|finding| &finding.place) {
        Some(Place::File { path, .. }) => path,
        _ => "the input",
    }
}

#[cfg(test)]
mod tests {
    use host_sim::coverage::Coverage;

    use super::*;

    #[derive(Serialize)]
    struct Found(u32);

    impl Outcome for Found {
        fn text(&self) -> String {
            String::new()
        }
    }

    #[test]
    fn a_run_that_ended_early_has_a_message_and_an_exit_code_of_its_own() {
        let early = RunError::EndedEarly { coverage: Coverage::new(500, 10_000, 1e-4), status: 0 };
        let late = RunError::NotEnded { coverage: Coverage::new(500, 500, 1e-4), status: 1 << 18 };
        let other = RunError::NotReady { limit: 1.0, status: 0 };
        for (error, expected) in [(early, ENDED_EARLY), (late, ENDED_EARLY), (other, ENVIRONMENT)] {
            let message = error.to_string();
            let mut ui = Ui::called(|_| (), None);
            assert_eq!(ui.failed(&error.into()), expected, "{message}");
            let document = ui.taken();
            assert_eq!((&document["error"], &document["result"]), (&json!(message), &Value::Null));
        }
        // Of several, with the figures of the others.
        let mut ui = Ui::called(|_| (), None);
        assert!(ui.scored(&Found(3), &[]).is_ok());
        let failure = ui.scored(&Found(3), &["line".to_owned()]).unwrap_err();
        assert_eq!(ui.failed(&failure), ENDED_EARLY);
        let document = ui.taken();
        assert_eq!(document["result"], json!(3));
        assert!(document["error"].as_str().is_some_and(|text| text.ends_with("no figure: line")), "{document:#}");
    }
}
