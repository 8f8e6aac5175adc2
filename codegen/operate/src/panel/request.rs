//! Requests of a page or of the wiring check to the machine.

use std::time::{Duration, Instant};

use serde_json::Value;
use specgen_language::ui::Ui;
use specgen_link::client::Port;
use specgen_runtime::supervisor::Request;

use crate::command::Command;
use crate::commands::{Operator, SessionError};
use crate::session::POLL_INTERVAL;

/// Ticks without a request before an edge-triggered one.
const BEFORE: u64 = 10;

/// Executes a command, and returns its answer.
pub(super) fn execute<P: Port>(
    operator: &mut Operator<P>,
    command: &Command,
    quiet: &Ui,
) -> Result<Value, SessionError> {
    operator.answers.clear();
    operator.execute(command, quiet)?;
    Ok(operator.answers.pop().map_or(Value::Null, |answer| answer.answer))
}

/// Sends an edge-triggered request.
pub(super) fn send_edge<P: Port>(operator: &mut Operator<P>, request: Request) -> Result<(), SessionError> {
    operator.in_control = true;
    operator.session.supervise(Request::None)?;
    let (sent, since) = (operator.status().tick, Instant::now());
    // A machine that is not ticking also gets the request.
    while operator.status().tick < sent + BEFORE && since.elapsed() < POLL_INTERVAL {
        std::thread::sleep(Duration::from_millis(1));
        operator.look()?;
    }
    operator.session.supervise(request)?;
    operator.look()
}
