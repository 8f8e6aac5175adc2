//! Commands of the page in control.

use std::cell::RefCell;
use std::rc::Rc;

use crate::Command;
use serde_json::{Value, json};
use specgen_link::RecorderAction;
use specgen_link::client::Port;
use specgen_runtime::supervisor::{Phase, Request};
use tungstenite::Message;

use super::clients::{EdgeRequest, PageRequest};
use super::commissioning::Runner;
use super::request::{execute, send_edge};
use super::{Panel, wiring};
use crate::commands::{Operator, SessionError, recoverable};
use specgen_language::ui::Ui;

/// Type number of a message with a record.
const RECORD: u32 = 2;

/// Queries health, reach of each axis, recorder, gains, and the settings that differ from those of the spec. Queries that the device
/// does not support are omitted.
pub(super) fn queries<P: Port>(
    operator: &mut Operator<P>,
    of_spec: &[u64],
    quiet: &mut Ui,
) -> Result<Value, SessionError> {
    let mut known = json!({});
    let commands = [
        ("standing", Command::Status),
        ("reach", Command::Limits),
        ("recorder", Command::Record(RecorderAction::Look)),
        ("gains", Command::Gains(Vec::new())),
    ];
    for (key, command) in commands {
        let answer = execute(operator, &command, quiet);
        match answer {
            Ok(value) => known[key] = value,
            Err(error) => {
                recoverable(Err(error), quiet)?;
            }
        }
    }
    match operator.session.config() {
        Ok(words) => {
            let names = &operator.session.description().config_names;
            let differ = names.iter().zip(words.iter().zip(of_spec)).filter(|(_, (word, of_spec))| word != of_spec);
            // `kp[0]` to `kp[5]` are one setting for a reader.
            let mut differ: Vec<&str> = differ.map(|(name, _)| name.split('[').next().unwrap_or(name)).collect();
            differ.dedup();
            known["differ"] = json!(differ);
        }
        Err(error) => {
            recoverable(Err(error.into()), quiet)?;
        }
    }
    Ok(known)
}

/// Executes a request of a page.
pub(super) fn carry_out<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    page: u64,
    request: &PageRequest,
    quiet: &Ui,
) -> Result<Value, SessionError> {
    if panel.borrow().is_commissioning() {
        return Err(SessionError::Refused("the machine is being commissioned: stop that first".to_owned()));
    }
    match request {
        PageRequest::Command { line, .. } => {
            let command = Command::parse(line).map_err(SessionError::Refused)?;
            let command = command.ok_or_else(|| SessionError::Refused("expected a command".to_owned()))?;
            if !is_for_pages(&command) {
                return Err(SessionError::Refused(format!(
                    "`{line}` is not available on a page: it uses files, waits, or ends the program"
                )));
            }
            if matches!(command, Command::StopWave) {
                panel.borrow_mut().wave = Value::Null;
            }
            let what = format!("Page {page}: {line}.");
            let value = execute(operator, &command, quiet)?;
            panel.borrow_mut().clients.note("note", &what, "", None);
            Ok(value)
        }
        PageRequest::Begin { request, .. } => {
            let (request, what) = match request {
                EdgeRequest::Arm => (Request::Arm, "arm"),
                EdgeRequest::Run => (Request::Run, "run"),
                EdgeRequest::Acknowledge => (Request::Acknowledge, "acknowledge"),
            };
            send_edge(operator, request)?;
            panel.borrow_mut().clients.note("note", &format!("Page {page} requested: {what}."), "", None);
            Ok(Value::Null)
        }
        PageRequest::Wave { name, text, .. } => {
            let wave = operator.wave_of_text(text).map_err(SessionError::Refused)?;
            operator.start_wave(name, &wave, false)?;
            let mut panel = panel.borrow_mut();
            panel.wave = json!({ "name": name, "tick": operator.status().tick });
            panel.clients.note("note", &format!("Page {page} started the wave {name}."), "", None);
            Ok(Value::Null)
        }
        PageRequest::Gain { factor, .. } => {
            let gains = panel.borrow().gains(operator, *factor).map_err(SessionError::Refused)?;
            let value = execute(operator, &Command::Gains(gains), quiet)?;
            panel.borrow_mut().clients.note(
                "note",
                &format!("Page {page} set all gains to {factor} of the spec's."),
                "",
                None,
            );
            Ok(value)
        }
        PageRequest::Restore { .. } => {
            let settings = panel.borrow().compiled.ir.integrity.settings.clone();
            operator.configure(&settings, |name| format!("the device refused `{name}` of the spec"))?;
            panel.borrow_mut().clients.note(
                "note",
                &format!("Page {page} restored the settings of the spec."),
                "",
                None,
            );
            Ok(Value::Null)
        }
        PageRequest::Download { .. } => {
            let record = operator.record()?;
            let mut bytes = RECORD.to_le_bytes().to_vec();
            bytes.extend(&record);
            panel.borrow().clients.tell(page, Message::binary(bytes));
            Ok(json!(record.len()))
        }
        PageRequest::Commission { .. } => {
            if u64::from(operator.phase()) != Phase::Disarmed.word() {
                return Err(SessionError::Refused("it begins with a disarmed machine: ramp down first".to_owned()));
            }
            // The command is the host in control; this one only watches, and stops.
            operator.in_control = false;
            let mut panel = panel.borrow_mut();
            let runner = panel.commissioning.as_mut().ok_or("no folder for it: start the panel with --commission DIR");
            runner.map_err(str::to_owned).and_then(Runner::begin).map_err(SessionError::Refused)?;
            panel.clients.note("note", &format!("Page {page} began the commissioning."), "", None);
            Ok(Value::Null)
        }
        PageRequest::Check { .. } => {
            panel.borrow_mut().clients.note("note", &format!("Page {page} started the wiring check."), "", None);
            let checked = wiring::check(operator, panel);
            panel.borrow_mut().check["runs"] = json!(false);
            checked
        }
        _ => Ok(Value::Null),
    }
}

/// Whether a page may send a command as a line.
fn is_for_pages(command: &Command) -> bool {
    match command {
        Command::Ask(request) => matches!(request, Request::None | Request::Arm | Request::Run | Request::Acknowledge),
        Command::Play { correction, .. } => correction.is_none(),
        Command::Status
        | Command::Where
        | Command::Limits
        | Command::CanIGo { .. }
        | Command::Move { .. }
        | Command::Goto(_)
        | Command::Mark(_)
        | Command::Mode(_)
        | Command::Gains(_)
        | Command::Record(_)
        | Command::StopWave => true,
        _ => false,
    }
}
