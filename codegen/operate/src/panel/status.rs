//! Status messages for the operator: state of the machine, and advice.

use crate::GAUGES;
use serde::Serialize;
use specgen_compiler::ir::Supervision;
use specgen_language::model::Model;
use specgen_link::Status;
use specgen_runtime::setpoint::{BUSY, REFUSED, STALE};
use specgen_runtime::supervisor::{Cause, Fault, Finding, FindingText, Phase};

/// Kind (`ok`, `note`, `warning`, `error`), state, advice, and the number of the cause with its limit.
#[derive(Serialize)]
pub struct StatusMessage {
    pub kind: &'static str,
    pub what: String,
    #[serde(rename = "do")]
    pub advice: &'static str,
    pub code: Option<String>,
}

/// State and advice of a cause.
fn cause(cause: Cause) -> (&'static str, &'static str) {
    match cause {
        Cause::None => ("", ""),
        Cause::GaugeNotFinite => ("A gauge reading is not a number.", "Check its converter and cable."),
        Cause::GaugeRange => ("A gauge is out of range.", "Check its cable and its zero."),
        Cause::GaugeStuck => ("A gauge does not follow the legs.", "Check its cable and converter."),
        Cause::GaugeDisagreement => (
            "A gauge disagrees with the model.",
            "Check cables and mounts of the gauges, and that nothing touches the platform.",
        ),
        Cause::TrackingError => {
            ("The platform does not follow its set-point.", "Check load, gains, and that nothing touches the platform.")
        }
        Cause::VoltageSaturation => ("A leg is at its voltage limit.", "Move to where the legs have room."),
        Cause::SlewSaturation => ("A leg is at its slew-rate limit.", "Move or play more slowly."),
        Cause::MissedTick => ("Ticks were missed.", "Check the load of the controller's computer."),
        Cause::LinkLost => ("The host was silent.", "Check the link."),
        Cause::Integrity => ("Tables or settings differ from the build.", "Flash the controller again."),
        Cause::Converter => ("A converter does not respond.", "Check its supply and cables."),
        Cause::EmergencyStop => ("The emergency stop is pressed.", "Release it when it is safe."),
        Cause::HostGone => ("The host was gone for too long.", "Check the link."),
        Cause::Wiring => ("The wiring of gauges or legs does not match the spec.", "Fix it with the amplifiers off."),
        Cause::AmplifierFault => {
            ("An amplifier reports a fault.", "Check the amplifiers, then the cable of their fault line.")
        }
        Cause::Workspace => (
            "The platform came near the end of its workspace in an open drive.",
            "Drive fewer legs at a time, or less.",
        ),
        Cause::NotIdentified => (
            "The legs are not identified: this machine has the open drive only.",
            "Drive it, or identify the legs: `specgen commission`.",
        ),
        Cause::Stalled => ("The controller stalled.", "Was a debugger attached, or the computer suspended?"),
        Cause::Oscillation => (
            "The platform oscillates.",
            "Check for a structural mode that the spec lacks, loose bolts, floor vibration. Then acknowledge.",
        ),
    }
}

/// Advice on a finding of the wiring check.
pub fn advice(finding: Finding) -> &'static str {
    match finding {
        Finding::None | Finding::Fallback(_) => "",
        Finding::Gauge(_, Fault::Inverted) => "Swap the wires of the gauge, or reverse its `direction` in the spec.",
        Finding::Gauge(_, Fault::Dead) => "Check cable and supply of the gauge.",
        Finding::Gauge(_, Fault::Swapped(_)) => "Swap the cables of the two gauges, or their `[[gauge]]` in the spec.",
        Finding::Gauge(_, Fault::Gain(_)) => "Check `sensor.range` or its calibration, and the range of its converter.",
        Finding::Leg(_, Fault::Inverted) => {
            "Switch off. Swap the wires of the stack only if its marking shows that they are wrong; otherwise check its gauge."
        }
        Finding::Leg(_, Fault::Dead) => "Check amplifier, cable and bolts of the leg.",
        Finding::Leg(_, Fault::Swapped(_)) => "Swap the amplifier cables of the two legs.",
        Finding::Leg(_, Fault::Gain(_)) => "Check the amplifier's gain, `dac.range` and the record of the leg.",
        Finding::Nothing => "Check the supplies of amplifiers and gauges, and that stacks are connected.",
        Finding::Inverted => {
            "Compare the gauges' wires and `direction` with the drawing. Swap wires of stacks only if their markings show that they are wrong."
        }
        Finding::Common(_) => {
            "Check the amplifiers' gain and `dac.range`, `sensor.range` or its calibration, and `actuator.stroke`."
        }
        Finding::Unexplained => {
            "If something shakes the machine, stop that or raise `wiring_check.amplitude`. Otherwise look for a connector that is turned, then check gauge by gauge and leg by leg, with the others unplugged."
        }
        Finding::NoRoom => "Widen `code_min` and `code_max`.",
        Finding::TooSlow => "Raise `max_step_codes`.",
    }
}

/// The limit of a cause in the spec.
fn limit(of: Cause, rules: &Supervision, model: &Model) -> Option<String> {
    let micrometres = |length: f64| format!("limit {}\u{2009}µm", (length * 1e8).round() / 100.0);
    let share = model.supervisor.tracking_error * 100.0;
    match of {
        Cause::GaugeDisagreement => Some(micrometres(rules.disagreement)),
        Cause::GaugeStuck => Some(micrometres(rules.stuck_motion)),
        Cause::TrackingError => Some(format!("limit {share:.0}\u{2009}% of the workspace")),
        Cause::MissedTick => Some(format!("limit {} in 1\u{2009}s", model.supervisor.missed_ticks)),
        Cause::Stalled => Some(format!("limit {} in a row", model.supervisor.missed_in_a_row)),
        // Index 2 is a translation (z), or a leg.
        Cause::Oscillation => Some(format!("limit {:.0}\u{2009}nm", 1e9 / rules.steadiness.per_limit[2])),
        Cause::LinkLost => {
            Some(format!("limit {:.0}\u{2009}ms", f64::from(rules.host_ticks) * model.timing.period * 1e3))
        }
        _ => None,
    }
}

/// The message of a machine with this status.
pub fn message(status: &Status, rules: &Supervision, model: &Model) -> StatusMessage {
    let finding = Finding::of_word(u32::from(status.finding));
    let phase = Phase::from_word(u64::from(status.phase));
    let of = Cause::from_word(u64::from(status.cause)).unwrap_or(Cause::None);
    let (what, advice) = match (cause(of), finding) {
        ((what, advice), Finding::None) => (what.to_owned(), advice),
        ((what, advice), Finding::Fallback(_)) if of != Cause::None => {
            (format!("{what} Fallen back: {finding}."), advice)
        }
        // A hold has cleared the cause, but the fallback stays.
        (_, Finding::Fallback(_)) => (format!("It oscillated; fallen back: {finding}."), cause(Cause::Oscillation).1),
        ((what, _), _) => {
            (format!("{what} The wiring check found: {}.", FindingText(finding, rules.alike())), advice(finding))
        }
    };
    let what = what.as_str();
    let code = (of != Cause::None).then(|| {
        let limit = limit(of, rules, model).map_or(String::new(), |limit| format!(" · {limit}"));
        format!("cause {}{limit}", of.word())
    });
    let message = |kind, what: &str, advice| StatusMessage { kind, what: what.to_owned(), advice, code: code.clone() };
    match phase {
        Some(Phase::Disarmed) => message("note", "Disarmed. Amplifiers are off.", "To start: arm, then run."),
        Some(Phase::Arming) => message("note", "Arming. Checking the wiring, leg by leg.", "Run can be requested now."),
        Some(Phase::Running) => {
            let bits = status.status & !BUSY;
            let (kind, what, advice) = if of != Cause::None {
                return message("error", &format!("Running. {what}"), advice);
            } else if bits & REFUSED != 0 {
                ("warning", "Running. The last command was refused.", "Hold, run, and move within reach.")
            } else if bits & STALE != 0 {
                ("warning", "Running. The stream of set-points has stopped.", "Move, or send set-points.")
            } else if bits & GAUGES != 0 {
                ("warning", "Running. A gauge is not read, or implausible.", "Check its converter and cable.")
            } else if bits != 0 {
                ("warning", "Running, with a limit reached.", "See the status below the events.")
            } else if status.status & BUSY != 0 {
                ("ok", "Running. A motion is in progress.", "")
            } else {
                ("ok", "Running. Nothing to do.", "")
            };
            message(kind, what, advice)
        }
        Some(Phase::Holding) if what.is_empty() => message("note", "Holding. The law is suspended.", "Run resumes."),
        Some(Phase::Holding) => message("warning", &format!("Holding. {what}"), advice),
        Some(Phase::Driving) => message("note", "Open drive. A host commands the voltages.", "Hold ends it."),
        Some(Phase::RampingDown) if of == Cause::None => message("note", "Ramping down.", ""),
        Some(Phase::RampingDown) => message("error", &format!("Ramping down. {what}"), advice),
        Some(Phase::Faulted) => message("error", what, advice),
        None => message("error", "The machine reports an unknown phase.", "Use matching specgen versions."),
    }
}
