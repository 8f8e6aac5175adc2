//! The wiring check of a page. It arms the machine, whose controller checks gauges and legs, and reports the result.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::{Value, json};
use specgen_link::client::Port;
use specgen_runtime::supervisor::{Cause, Finding, FindingText, Phase, Request};

use super::request::send_edge;
use super::{Panel, status};
use crate::commands::{Operator, SessionError};

/// Extra time for arming, beyond that of the spec.
const PATIENCE: Duration = Duration::from_secs(20);

/// Result of the check, and advice.
#[derive(Serialize)]
struct Verdict {
    good: bool,
    what: String,
    advice: &'static str,
}

/// Arms a disarmed machine. It then holds if gauges and legs match the spec; otherwise it faults, and the verdict has the reason.
pub(super) fn check<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
) -> Result<Value, SessionError> {
    let refused = |why: String| Err(SessionError::Refused(why));
    let (rules, off, period) = {
        let panel = panel.borrow();
        let model = &panel.compiled.model;
        (panel.compiled.ir.supervision.clone(), model.supervisor.wiring_check.off.clone(), model.timing.period)
    };
    let Some(wiring) = &rules.wiring else {
        return refused(format!("the spec switches the wiring check off: {}", off.unwrap_or_default()));
    };
    let phase = |operator: &Operator<P>| Phase::from_word(u64::from(operator.phase()));
    if phase(operator) != Some(Phase::Disarmed) {
        return refused("the check arms the machine: first ramp down, or acknowledge its fault".to_owned());
    }
    panel.borrow_mut().check = json!({ "runs": true, "done": 0 });
    let first = operator.status().tick + u64::from(rules.arm_ticks);
    send_edge(operator, Request::Arm)?;
    let whole = f64::from(rules.arm_ticks) + 6.0 * f64::from(wiring.ticks);
    let (since, limit) = (Instant::now(), PATIENCE + Duration::from_secs_f64(whole * period));
    let mut arms = false;
    let verdict = loop {
        operator.look()?;
        if std::mem::take(&mut panel.borrow_mut().clients.ends) {
            return refused("the check was stopped".to_owned());
        }
        let legs = operator.status().tick.saturating_sub(first) / u64::from(wiring.ticks);
        panel.borrow_mut().check["done"] = json!(legs.min(6));
        let status = operator.session.status();
        match phase(operator) {
            Some(Phase::Holding | Phase::Running) => {
                let what = match wiring.leg_gain {
                    Some(_) => "Gauges and legs match the spec: sign, order and gain.",
                    None => {
                        "Gauges and legs match the spec: sign and order. Gains of legs are not tested until each has a record."
                    }
                };
                break Verdict { good: true, what: what.to_owned(), advice: "" };
            }
            Some(Phase::Faulted | Phase::RampingDown) if u64::from(status.cause) == Cause::Wiring.word() => {
                let finding = Finding::of_word(u32::from(status.finding));
                let what = format!("{}.", FindingText(finding, rules.alike()));
                break Verdict { good: false, what, advice: status::advice(finding) };
            }
            Some(Phase::Faulted) => return Err(SessionError::Fault(format!("the machine is {}", operator.state()))),
            // Another host has held it, or ramped it down.
            Some(Phase::Disarmed | Phase::RampingDown) if arms => return refused("the check was stopped".to_owned()),
            _ if since.elapsed() > limit => return refused(format!("the machine is still {}", operator.state())),
            now => {
                arms |= now == Some(Phase::Arming);
                std::thread::sleep(Duration::from_millis(2));
            }
        }
    };
    let kind = if verdict.good { "note" } else { "error" };
    let mut panel = panel.borrow_mut();
    panel.clients.note(kind, &format!("Wiring check: {}", verdict.what), verdict.advice, None);
    panel.check = json!({ "runs": false, "done": 6, "verdict": verdict });
    Ok(json!(verdict))
}
