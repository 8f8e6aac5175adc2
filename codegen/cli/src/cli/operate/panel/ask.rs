//! What a page or a check asks of the machine.

use std::time::{Duration, Instant};

use serde_json::Value;
use specgen_link::client::Port;
use specgen_operate::{ALIVE, Order};
use specgen_runtime::supervisor::Request;

use crate::cli::operate::{Ended, Operator};
use specgen_language::ui::Ui;

/// How long a request that is to begin to be given is not given before, ticks.
const BEFORE: u64 = 10;

/// The answer to an order as `operate` gives it.
pub(super) fn ask<P: Port>(operator: &mut Operator<P>, order: &Order, quiet: &Ui) -> Result<Value, Ended> {
    operator.answers.clear();
    operator.obey(order, quiet)?;
    Ok(operator.answers.pop().map_or(Value::Null, |answer| answer.answer))
}

/// Asks for what counts when it begins to be given.
pub(super) fn begin<P: Port>(operator: &mut Operator<P>, request: Request) -> Result<(), Ended> {
    operator.ordered = true;
    operator.session.supervise(Request::None)?;
    let (sent, since) = (operator.status().tick, Instant::now());
    // A machine without ticks is asked all the same.
    while operator.status().tick < sent + BEFORE && since.elapsed() < ALIVE {
        std::thread::sleep(Duration::from_millis(1));
        operator.look()?;
    }
    operator.session.supervise(request)?;
    operator.look()
}
