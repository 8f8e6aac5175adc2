//! Injects faults into a running machine and checks the reaction and its time.

use std::process::Stdio;

use specgen_compiler::compile;
use specgen_compiler::ir::Ir;
use specgen_runtime::supervisor::Reaction;

use super::Trial;
use super::session::{Host, Session};

/// Time of the board before and after a fault, ms.
const RUNS: f64 = 50.0;
const RECOVERS: f64 = 200.0;
/// Interval between checks of the board, ms.
const STEP: f64 = 20.0;
/// Reaction time of the emergency contact, in hardware, ms.
const CONTACT: f64 = 0.001;
/// Reaction time of the interrupt of the voltage detector, during a tick, ms.
const DETECTOR: f64 = 0.002;
/// Time for which a debugger halts the core, ms.
const HELD: f64 = 1000.0;
/// Reaction time of the watchdog, 20 ms, plus the start of the program, ms.
const WATCHDOG: f64 = 25.0;
/// Reaction time for a dead background, ms.
const BACKGROUND: f64 = 1000.0;
/// Stopping time of a motion by the limits of stops, ms.
const STOPS: f64 = 50.0;
/// Time for which a machine must continue to run, ms.
const RUNS_ON: f64 = 300.0;

/// Times of a spec, ms.
struct Times {
    period: f64,
    /// Reaction time for an invalid gauge or converter.
    gauge: f64,
    /// Time of silence after which a host is lost.
    host: f64,
    /// Time to stop and ramp down from the highest code.
    down: f64,
    /// Reaction to an amplifier fault.
    amplifier: Reaction,
}

impl Times {
    fn of(ir: &Ir) -> Self {
        let period = ir.defaults.period * 1e3;
        let supervision = &ir.supervision;
        let [_, gauge, .., gone] = supervision.timeout.map(f64::from);
        let steps = f64::from(ir.actuation.code_max - ir.actuation.code_min) / f64::from(supervision.ramp_step);
        Self {
            period,
            gauge: gauge * period,
            host: (f64::from(supervision.host_ticks) + gone) * period,
            down: STOPS + steps * f64::from(supervision.ramp_every) * period,
            amplifier: supervision.amplifier_fault,
        }
    }
}

/// Expected reaction to a fault.
enum End {
    /// Amplifiers off within so many ms.
    Off(fn(&Times) -> f64),
    /// None: the host continues.
    RunsOn,
    /// The spec's reaction to an amplifier fault.
    Amplifier,
    /// The machine holds with amplifiers on, and continues after a new request to run.
    Holds,
    /// Amplifiers off while the core is halted, then a ramp and the fault `stalled`.
    Stalled,
}

/// Some codes of a faulty DAC may be right by chance, and the fault counter leaks: that takes at most twice the time.
const FAULTS: [(&str, End); 21] = [
    ("stop", End::Off(|_| CONTACT)),
    ("amplifier", End::Amplifier),
    ("adc-dead", End::Off(|times| times.gauge + times.down)),
    ("adc-endless", End::Off(|times| times.gauge + times.down)),
    ("adc-shifted", End::Off(|times| times.gauge + times.down)),
    ("adc-no-reference", End::Off(|times| times.gauge + times.down)),
    ("adc-blank", End::Off(|times| times.gauge + times.down)),
    ("adc-again", End::Off(|times| times.gauge + times.down)),
    ("dac-stuck", End::Off(|times| 2.0 * times.gauge + times.down)),
    ("dac-mute", End::Off(|times| 2.0 * times.gauge + times.down)),
    ("uart", End::RunsOn),
    ("uart-noise", End::Off(|times| times.host + times.down)),
    ("host-killed", End::Off(|times| times.host + times.down)),
    ("background", End::Off(|times| BACKGROUND + times.down)),
    ("hang", End::Off(|_| WATCHDOG)),
    ("hang-stop", End::Off(|_| CONTACT)),
    ("hard-fault", End::Off(|times| times.period)),
    ("halt", End::Stalled),
    ("clock", End::Off(|_| CONTACT)),
    ("supply", End::Off(|_| DETECTOR)),
    ("brown-out", End::Off(|times| times.period)),
];

/// Whether a fault has this name.
pub fn is_known(name: &str) -> bool {
    FAULTS.iter().any(|(known, _)| *known == name)
}

/// Every fault on a separate machine, or only the one with this name.
pub fn run(trial: &Trial, only: Option<&str>) -> Result<(), String> {
    let compiled = compile::compile(&trial.spec).map_err(|_| format!("{} is refused", trial.spec.display()))?;
    let times = Times::of(&compiled.ir);
    let mut wrong = Vec::new();
    for (name, end) in FAULTS.iter().filter(|(name, _)| only.is_none_or(|only| only == *name)) {
        match one(trial, name, end, &times) {
            Ok(text) => println!("{} {name}: {text}", trial.target),
            Err(why) => wrong.push(format!("{name}: {why}")),
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(format!("{}: {}", trial.target, wrong.join("; "))) }
}

fn one(trial: &Trial, name: &str, end: &End, times: &Times) -> Result<String, String> {
    let mut session = Session::begin(trial)?;
    let mut host = Host::of(session.command_of(trial, "operate"))?;
    host.order("arm\nwait holding 600\nrun\nwait running 600\nset command=0\nstatus", ": running, ")?;
    session.pass(RUNS)?;
    // The board logs both with their times.
    session.log.clear();
    if name == "host-killed" {
        host.end();
    }
    let answer = session.command(&format!("fail {name}"))?;
    if answer.text != "failed" {
        return Err(answer.text);
    }
    let off = |session: &mut Session, limit: f64| -> Result<Option<f64>, String> {
        let mut left = limit;
        loop {
            if let [Some(fault), Some(off)] = ["fault ", "amplifiers off"].map(|what| session.logged(what)) {
                return Ok(Some(off - fault));
            }
            if left <= 0.0 {
                return Ok(None);
            }
            session.pass(STEP)?;
            session.report()?;
            left -= STEP;
        }
    };
    // Read once a tick.
    let end = match (end, times.amplifier) {
        (End::Amplifier, Reaction::Off) => &End::Off(|times| 2.0 * times.period),
        (End::Amplifier, Reaction::RampDown) => &End::Off(|times| 2.0 * times.period + times.down),
        (End::Amplifier, Reaction::Hold) => &End::Holds,
        (other, _) => other,
    };
    let text = match end {
        End::Amplifier => return Err("it has no end".to_owned()),
        End::Holds => {
            if let Some(took) = off(&mut session, RUNS_ON)? {
                return Err(format!("amplifiers off after {took:.3} ms"));
            }
            host.order("run\nwait 0.1\nstatus", ": holding: amplifier fault, ")?;
            session.command("heal")?;
            session.pass(STEP)?;
            host.order("hold\nrun\nwait running 60\nstatus", ": running, ")?;
            "the machine holds, whatever is asked for; mended, it runs again".to_owned()
        }
        End::Off(limit) => {
            let limit = limit(times);
            let took = off(&mut session, limit + STEP)?.ok_or(format!("amplifiers still on after {limit:.1} ms"))?;
            if took > limit {
                return Err(format!("amplifiers off after {took:.3} ms, at most {limit:.3} ms"));
            }
            host.end();
            // It continues without a clock at its pin, too.
            if name != "clock" {
                session.command("heal")?;
            }
            session.pass(RECOVERS)?;
            shows(trial, &session, reset_cause_of(name))?;
            arms_again(trial, &session)?;
            format!("amplifiers off after {took:.3} ms, at most {limit:.3} ms; acknowledged, it arms again")
        }
        End::Stalled => {
            // The event is reported after the answer to the command.
            session.pass(STEP)?;
            session.report()?;
            let (Some(begun), Some(off)) = (session.logged("fault "), session.first_logged("amplifiers off")) else {
                return Err("amplifiers stay on while the core is held".to_owned());
            };
            if off - begun > CONTACT {
                return Err(format!("amplifiers off {:.3} ms after the core was held", off - begun));
            }
            session.pass(times.down + RECOVERS)?;
            host.end();
            shows(trial, &session, "faulted: stalled, amplifiers off")?;
            arms_again(trial, &session)?;
            format!(
                "amplifiers off {:.3} ms after the core was held for {HELD:.0} ms, then faulted: stalled; it arms again",
                off - begun
            )
        }
        End::RunsOn => {
            if let Some(took) = off(&mut session, RUNS_ON)? {
                return Err(format!("amplifiers off after {took:.3} ms"));
            }
            host.order("status", ": running, ").map_err(|why| format!("the link stays deaf: {why}"))?;
            "the machine runs on, and its host goes on".to_owned()
        }
    };
    Ok(text)
}

/// Text of `status` about the board's reset after a fault, for faults that end in one.
fn reset_cause_of(name: &str) -> &'static str {
    match name {
        "hang" | "hard-fault" | "supply" => "reset cause: reset pin, watchdog\n",
        "amplifier" => "faulted: amplifier fault, amplifiers off",
        "clock" => "reset cause: reset pin, watchdog, no external clock\n",
        "brown-out" => "reset cause: brown-out, reset pin\n",
        _ => "",
    }
}

/// Checks the text of `status` for a new host.
fn shows(trial: &Trial, session: &Session, words: &str) -> Result<(), String> {
    let output = session.command_of(trial, "operate").arg("status").output();
    let output = output.map_err(|error| format!("specgen operate: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if text.contains(words) { Ok(()) } else { Err(format!("`status` does not say `{words}`:\n{text}")) }
}

/// Checks that a new host can acknowledge once and arm.
fn arms_again(trial: &Trial, session: &Session) -> Result<(), String> {
    let mut again = session.command_of(trial, "operate");
    again.args(["acknowledge", "wait 0.2", "arm", "wait holding 60", "ramp-down", "wait disarmed 60"]);
    match again.stdout(Stdio::null()).stderr(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(()),
        _ => Err("a new host cannot arm it again".to_owned()),
    }
}
