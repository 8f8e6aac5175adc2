//! Faults put into a running machine, and what became of each as it is today: a change for the better is to be written here too.

use std::process::Stdio;

use super::Trial;
use super::session::{Host, Session};

/// Time of the board that a fault is given, and that the machine gets to recover, ms.
const LASTS: f64 = 600.0;
const RECOVERS: f64 = 200.0;

/// What becomes of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct End {
    /// Amplifiers are off within [`LASTS`].
    off: bool,
    /// Without the fault, a new host acknowledges and arms again.
    recovers: bool,
}

const SAFE: End = End { off: true, recovers: true };

/// Name, what becomes of it today, and what is wrong with that.
const FAULTS: [(&str, End, &str); 14] = [
    ("stop", SAFE, ""),
    (
        "adc-dead",
        End { off: true, recovers: false },
        "an acknowledgement does not reset it: the cause reads gauge not finite",
    ),
    ("adc-endless", End { off: true, recovers: false }, "the same"),
    ("adc-shifted", SAFE, ""),
    ("adc-no-reference", SAFE, ""),
    ("adc-blank", SAFE, ""),
    ("dac-stuck", End { off: false, recovers: true }, "holds with amplifiers on"),
    ("dac-mute", End { off: false, recovers: true }, "holds with amplifiers on"),
    ("uart", End { off: false, recovers: false }, "the link stays deaf, and the machine holds with amplifiers on"),
    ("host-killed", End { off: false, recovers: true }, "holds with amplifiers on"),
    ("background", End { off: false, recovers: true }, "not noticed while amplifiers are on"),
    ("hang", SAFE, ""),
    ("hard-fault", SAFE, ""),
    ("brown-out", SAFE, ""),
];

/// Every fault on a machine of its own.
pub fn run(trial: &Trial) -> Result<(), String> {
    let mut wrong = Vec::new();
    for (name, expected, known) in FAULTS {
        let found = one(trial, name)?;
        let End { off, recovers } = found;
        let amplifiers = if off { "off" } else { "ON" };
        let again = if recovers { "arms again" } else { "does not arm again" };
        println!(
            "{} {name}: amplifiers {amplifiers}, {again}{}{known}",
            trial.target,
            if known.is_empty() { "" } else { "; known: " }
        );
        if found != expected {
            wrong.push(format!("{name}: expected {expected:?}, found {found:?}"));
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(format!("{}: {}", trial.target, wrong.join("; "))) }
}

fn one(trial: &Trial, name: &str) -> Result<End, String> {
    let mut session = Session::begin(trial)?;
    let mut host = Host::of(session.host(trial))?;
    host.order("arm\nwait holding 60\nrun\nwait running 60\nset command=0\nstatus", ": running, ")?;
    session.pass(50.0)?;
    if name == "host-killed" {
        host.end();
    } else {
        let answer = session.command(&format!("fail {name}"))?;
        if answer.text != "failed" {
            return Err(answer.text);
        }
    }
    session.pass(LASTS)?;
    let off = session.report()?.value("enable") == Some(0.0);
    session.command("heal")?;
    host.end();
    // Long enough to miss the host: a machine that still runs then holds.
    session.pass(RECOVERS)?;
    let mut again = session.host(trial);
    again.args(["acknowledge", "wait 1", "none", "wait 0.2", "arm", "wait holding 20"]);
    let recovers = again.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success());
    Ok(End { off, recovers })
}
