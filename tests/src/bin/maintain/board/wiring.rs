//! The wiring check on a board: every single fault of a gauge or a leg, one after the other, must be refused and named.

use std::ops::Range;

use specgen_compiler::{compile, lower};
use specgen_runtime::supervisor::{Fault, Finding};

use super::Trial;
use super::session::{Host, Session};

/// Measured gain for a factor of 0.5, with the spread of gauges and legs.
const HALF: Range<f64> = 0.3..0.72;
const TWICE: Range<f64> = 1.42..2.8;
const REFUSED: &str = ": faulted: wiring, ";

/// Runs all faults on one machine, whose plant is rewired each time that its amplifiers are switched on.
pub fn run(trial: &Trial) -> Result<(), String> {
    let compiled = compile::compile(&trial.spec).map_err(|_| format!("{} is refused", trial.spec.display()))?;
    let Some(wiring) = &compiled.ir.supervision.wiring else { return Ok(()) };
    let faults = lower::single_faults();
    let mut session = Session::with(trial, &["--wrong", "all"])?;
    let mut host = Host::of(session.command_of(trial, "operate"))?;
    for fault in &faults {
        let line = host.order("arm\nwait faulted 600\nstatus", REFUSED)?;
        let named = line.split(REFUSED).nth(1).is_some_and(|text| is_named(text, *fault));
        let alike = wiring.alike.iter().any(|set| set.contains(&fault.word()));
        if !named && !alike {
            return Err(format!("{}: {fault}: {line}", trial.target));
        }
        host.order("acknowledge\nwait disarmed 600\nnone\nstatus", ": disarmed")?;
    }
    host.order("arm\nwait holding 600\nstatus", ": holding")?;
    host.order("ramp-down\nwait disarmed 600\nstatus", ": disarmed")?;
    let report = session.report()?;
    let (target, count, text) = (trial.target, faults.len(), &report.text);
    println!("{target}: {count} faults of the wiring refused and named, then armed without one; {text}");
    match report.violations.first() {
        Some(text) => Err(format!("{}: against a data sheet: {text}", trial.target)),
        None => Ok(()),
    }
}

/// Whether a status line starts with the words of the fault; for a gain, with a similar one.
fn is_named(text: &str, fault: Finding) -> bool {
    let (Finding::Gauge(_, Fault::Gain(made)) | Finding::Leg(_, Fault::Gain(made))) = fault else {
        return text.starts_with(&fault.to_string());
    };
    let words = fault.to_string();
    let gain =
        words.split_inclusive("× ").next().and_then(|words| text.strip_prefix(words)?.get(..4)?.parse::<f64>().ok());
    gain.is_some_and(|gain| if made < 100 { HALF } else { TWICE }.contains(&gain))
}
