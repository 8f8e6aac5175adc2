//! What a page orders, by the words of `operate`.

use std::cell::RefCell;
use std::rc::Rc;

use serde_json::{Value, json};
use specgen_link::RecorderAction;
use specgen_link::client::Port;
use specgen_operate::Order;
use specgen_runtime::supervisor::Request;
use tungstenite::Message;

use super::ask::{ask, begin};
use super::hall::{Asked, Begin};
use super::{Panel, check};
use crate::cli::operate::{Ended, Operator, mistake};
use specgen_language::ui::Ui;

/// Kind of a message with a record.
const RECORD: u32 = 2;

/// What it noticed, what each axis can still do, recorder and gains. What a device does not have is nothing.
pub(super) fn question<P: Port>(operator: &mut Operator<P>, quiet: &mut Ui) -> Result<Value, Ended> {
    let mut known = json!({});
    let orders = [
        ("standing", Order::Status),
        ("reach", Order::Limits),
        ("recorder", Order::Record(RecorderAction::Look)),
        ("gains", Order::Gains(Vec::new())),
    ];
    for (key, order) in orders {
        let answer = ask(operator, &order, quiet);
        match answer {
            Ok(value) => known[key] = value,
            Err(ended) => {
                mistake(Err(ended), quiet)?;
            }
        }
    }
    Ok(known)
}

pub(super) fn carry_out<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    page: u64,
    order: &Asked,
    quiet: &Ui,
) -> Result<Value, Ended> {
    match order {
        Asked::Order { line, .. } => {
            let order = Order::parse(line).map_err(Ended::Refused)?;
            let order = order.ok_or_else(|| Ended::Refused("an order is expected".to_owned()))?;
            if !is_for_pages(&order) {
                return Err(Ended::Refused(format!(
                    "`{line}` is not for a page: it reads or writes files, waits, or ends the program"
                )));
            }
            if matches!(order, Order::StopWave) {
                panel.borrow_mut().wave = Value::Null;
            }
            let what = format!("Page {page}: {line}.");
            let value = ask(operator, &order, quiet)?;
            panel.borrow_mut().hall.note("note", &what, "", None);
            Ok(value)
        }
        Asked::Begin { request, .. } => {
            let (request, what) = match request {
                Begin::Arm => (Request::Arm, "arm"),
                Begin::Run => (Request::Run, "run"),
                Begin::Acknowledge => (Request::Acknowledge, "acknowledge"),
            };
            begin(operator, request)?;
            panel.borrow_mut().hall.note("note", &format!("Page {page} asked to {what}."), "", None);
            Ok(Value::Null)
        }
        Asked::Wave { name, text, .. } => {
            let (words, center) = operator.wave_of_text(text).map_err(Ended::Refused)?;
            operator.start_wave(name, &words, &center, false)?;
            let mut panel = panel.borrow_mut();
            panel.wave = json!({ "name": name, "tick": operator.status().tick });
            panel.hall.note("note", &format!("Page {page} started the wave {name}."), "", None);
            Ok(Value::Null)
        }
        Asked::Gain { factor, .. } => {
            let gains = panel.borrow().gains(operator, *factor).map_err(Ended::Refused)?;
            let value = ask(operator, &Order::Gains(gains), quiet)?;
            panel.borrow_mut().hall.note(
                "note",
                &format!("Page {page} set all gains to {factor} of the spec's."),
                "",
                None,
            );
            Ok(value)
        }
        Asked::Download { .. } => {
            let record = operator.record()?;
            let mut bytes = RECORD.to_le_bytes().to_vec();
            bytes.extend(&record);
            panel.borrow().hall.tell(page, Message::binary(bytes));
            Ok(json!(record.len()))
        }
        Asked::Check { .. } => {
            panel.borrow_mut().hall.note("note", &format!("Page {page} began the wiring check."), "", None);
            let checked = check::run(operator, panel);
            panel.borrow_mut().check["runs"] = json!(false);
            checked
        }
        _ => Ok(Value::Null),
    }
}

/// What a page may order by a line.
fn is_for_pages(order: &Order) -> bool {
    match order {
        Order::Ask(request) => matches!(request, Request::None | Request::Arm | Request::Run | Request::Acknowledge),
        Order::Play { correction, .. } => correction.is_none(),
        Order::Status
        | Order::Where
        | Order::Limits
        | Order::CanIGo { .. }
        | Order::Move { .. }
        | Order::Goto(_)
        | Order::Mark(_)
        | Order::Mode(_)
        | Order::Gains(_)
        | Order::Record(_)
        | Order::StopWave => true,
        _ => false,
    }
}
