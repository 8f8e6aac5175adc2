//! Runs commands on a machine, from the command line, a script, or line by line.

mod answer;
mod error;
mod health;
mod location;
mod operator;
mod passes;
mod platform;
mod pose;
mod settings;
mod triggers;
mod watch;
mod waves;

use std::io::{BufRead, IsTerminal};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};

use serde::Serialize;
use specgen_compiler::compile::{self, Compilation};
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::read_text;
use specgen_language::ui::Ui;
use specgen_link::client::{ClientError, Port};
use specgen_runtime::supervisor::Request;

use crate::command::Command;
use crate::session::{POLL_INTERVAL, Session};
pub(crate) use answer::MachineStatus;
use answer::{CommandError, Report};
pub(crate) use error::SessionError;
pub(crate) use operator::{Operator, Pulse};
pub(crate) use passes::motion_name;
pub(crate) use platform::is_gain;

/// Source of commands.
pub enum Source {
    /// A list that is known in advance.
    List(Vec<Command>),
    /// Lines of an interactive session.
    Lines,
}

/// The result of a server for clients.
#[derive(Serialize)]
pub struct Service {
    /// The device that was served.
    pub device: String,
    /// The address.
    pub listened: String,
    /// State of the machine at the end.
    pub state: String,
}

impl Outcome for Service {}

impl Source {
    /// Parses every command before anything is sent to the machine: an error in the last line stops the first.
    ///
    /// # Errors
    /// A command is not valid, or the script cannot be read.
    pub fn parse(commands: &[String], script: Option<&Path>) -> Result<Self, Failure> {
        let Some(script) = script else {
            if commands.is_empty() {
                return Ok(Self::Lines);
            }
            let parsed: Result<Vec<_>, _> = commands.iter().map(|command| Command::parse(command)).collect();
            return Self::list(parsed.map_err(Failure::Usage)?.into_iter().flatten().collect());
        };
        if !commands.is_empty() {
            return Err(Failure::Usage("give commands either as arguments or with --script, not both".to_owned()));
        }
        let mut list = Vec::new();
        for (index, line) in read_text(script)?.lines().enumerate() {
            let place = |error| Failure::Usage(format!("{}:{}: {error}", script.display(), index + 1));
            list.extend(Command::parse(line).map_err(place)?);
        }
        Self::list(list)
    }

    fn list(commands: Vec<Command>) -> Result<Self, Failure> {
        if commands.iter().rev().skip(1).any(|command| *command == Command::Shutdown) {
            return Err(Failure::Usage("`shutdown` ends the session: it must be the last command".to_owned()));
        }
        Ok(Self::List(commands))
    }

    /// Compiles the specs of `config write` commands.
    ///
    /// # Errors
    /// One of them is refused.
    pub fn check_specs(&self) -> Result<(), Failure> {
        let Self::List(commands) = self else { return Ok(()) };
        for command in commands {
            if let Command::WriteConfig(spec) = command {
                compile::compile(spec)?;
            }
        }
        Ok(())
    }
}

/// Executes commands in a session with the device of this name. `is_only_host`: the link admits no other host, so this one is in
/// control.
///
/// # Errors
/// A command failed, the machine faulted, or the link broke.
pub fn run(
    session: Session<Box<dyn Port>>,
    name: &str,
    compiled: Option<Compilation>,
    is_only_host: bool,
    source: Source,
    ui: &mut Ui,
) -> Result<(), Failure> {
    if compiled.is_none() {
        let text = format!("{name}: the controller was not checked against a spec; name the spec to check it");
        ui.progress(&text);
    }
    let mut operator = Operator::new(session, interrupt::heed());
    if let Some(compiled) = compiled {
        operator.alike = compiled.ir.supervision.alike().to_vec();
        operator.model = Some(compiled.model);
    }
    operator.in_control = is_only_host;
    let ending = match source {
        Source::List(commands) => {
            // Check all of them first: an error halfway would end the session with the machine in motion.
            operator.check(&commands)?;
            list(&commands, &mut operator, ui)
        }
        Source::Lines => lines(&mut operator, ui),
    };
    finish(ending, &mut operator, name, ui)
}

/// The failure of a broken link.
pub(crate) fn lost_link(name: &str, error: &ClientError) -> Failure {
    Failure::Environment(format!(
        "{name}: {error}; without its host the machine holds, then ramps down (supervisor.host_lost)"
    ))
}

fn list(commands: &[Command], operator: &mut Operator<impl Port>, ui: &mut Ui) -> Result<(), SessionError> {
    for command in commands {
        operator.execute(command, ui)?;
    }
    // The last request must reach a tick before the link goes silent.
    operator.look()
}

/// Executes lines from standard input or the calling program, and polls the machine meanwhile. A failed command does not end the
/// session.
fn lines(operator: &mut Operator<impl Port + 'static>, ui: &mut Ui) -> Result<(), SessionError> {
    operator.attended = true;
    let (urgent, stops) = channel();
    operator.pulse = Some(Box::new(move |operator| match stops.try_recv() {
        Ok(request) => {
            operator.stop_by_hand(request)?;
            Err(SessionError::Refused("stopped from the terminal".to_owned()))
        }
        Err(_) => Ok(()),
    }));
    let lines = match ui.take_lines() {
        Some(lines) => {
            line("status", operator, ui)?;
            lines
        }
        None => reader(urgent),
    };
    if std::io::stdin().is_terminal() {
        ui.progress(&format!("{}; commands, one a line; end with Ctrl-D", operator.state()));
    }
    loop {
        match lines.recv_timeout(POLL_INTERVAL) {
            Ok(text) => {
                line(&text, operator, ui)?;
                if std::mem::take(&mut operator.was_stopped) {
                    // Lines sent before the stop must not move it.
                    for text in lines.try_iter() {
                        late(&text, operator, ui)?;
                    }
                }
            }
            Err(RecvTimeoutError::Timeout) => {
                recoverable(operator.look(), ui)?;
                operator.was_stopped = false;
                operator.show(ui);
            }
            Err(RecvTimeoutError::Disconnected) => return operator.look(),
        }
    }
}

/// Executes a line that was sent before the machine was stopped, unless it would cause motion.
fn late(text: &str, operator: &mut Operator<impl Port>, ui: &mut Ui) -> Result<(), SessionError> {
    if !matches!(Command::parse(text), Ok(Some(command)) if command.moves()) {
        return line(text, operator, ui);
    }
    operator.note(text, &CommandError { error: "the machine was stopped: command skipped".to_owned() }, ui);
    ui.answered(&mut operator.answers);
    Ok(())
}

/// Executes one line and answers it.
fn line(line: &str, operator: &mut Operator<impl Port>, ui: &mut Ui) -> Result<(), SessionError> {
    let done = match Command::parse(line) {
        Ok(None) => Ok(()),
        Ok(Some(command)) => operator.execute(&command, ui),
        Err(text) => Err(SessionError::Refused(text)),
    };
    if let Some(error) = recoverable(done, ui)? {
        operator.note(line, &CommandError { error }, ui);
    }
    ui.answered(&mut operator.answers);
    Ok(())
}

/// The reason of a failure that does not end the session.
pub(crate) fn recoverable(done: Result<(), SessionError>, ui: &mut Ui) -> Result<Option<String>, SessionError> {
    match done {
        Ok(()) => Ok(None),
        Err(SessionError::Refused(text) | SessionError::Fault(text)) => Ok(Some(text)),
        Err(SessionError::Failed(Failure::Environment(text) | Failure::Gate(text) | Failure::Usage(text))) => {
            Ok(Some(text))
        }
        Err(SessionError::Failed(Failure::Refused(refused))) => {
            ui.findings(refused.source.as_ref(), &refused.findings);
            Ok(Some("the spec is refused".to_owned()))
        }
        Err(other) => Err(other),
    }
}

/// Reads lines in a thread, so that the link stays alive. A stop typed at a terminal overtakes earlier lines.
fn reader(urgent: Sender<Request>) -> Receiver<String> {
    let (sender, receiver) = channel();
    let is_typed = std::io::stdin().is_terminal();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if is_typed
                && let Ok(Some(Command::Ask(request @ (Request::Hold | Request::RampDown)))) = Command::parse(&line)
            {
                let _ = urgent.send(request);
                continue;
            }
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

/// Reports the end of a session. After Ctrl-C it first ramps the machine down.
fn finish(
    ending: Result<(), SessionError>,
    operator: &mut Operator<impl Port>,
    name: &str,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let open = ending.is_ok();
    let report = Report { device: name, answers: std::mem::take(&mut operator.answers), status: operator.status() };
    match ending {
        Ok(()) | Err(SessionError::Stopped) => {
            // If another host is in control, the machine does not depend on this one.
            if open && operator.in_control && operator.is_powered() {
                let text =
                    "the amplifiers are on; without its host the machine holds, then ramps down (supervisor.host_lost)";
                ui.progress(&format!("{name}: {}: {text}", operator.state()));
            }
            ui.result(&report);
            Ok(())
        }
        Err(SessionError::Refused(text) | SessionError::Fault(text)) => {
            ui.judged(&report, Some(format!("{name}: {text}")))
        }
        Err(SessionError::Failed(failure)) => Err(failure),
        Err(SessionError::Link(error)) => Err(lost_link(name, &error)),
        Err(SessionError::Interrupted) => match operator.ramp_down(ui) {
            Ok(text) => {
                let result = ui.shown(&Report { status: operator.status(), ..report });
                Err(Failure::Interrupted { message: format!("interrupted; {text}"), result })
            }
            Err(error) => Err(Failure::Environment(format!("{name}: interrupted, and then: {error}"))),
        },
    }
}
