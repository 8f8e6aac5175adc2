//! The first-power check: each leg is driven a little, by feed-forward alone, and what the gauges show is held against the spec.
//!
//! The law that inverts the hysteresis and feeds nothing back does not mind what gauges say, so a gauge with a wrong sign or in the wrong
//! place cannot make it run away; the supervisor looks on as always, and may end the way to the bias, where every leg has room. What
//! the gauges showed until then tells what is turned.

mod judge;

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use specgen_compiler::lower;
use specgen_link::client::Port;
use specgen_operate::motion::Motion;
use specgen_operate::{Order, Until, Wanted};
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::supervisor::{Phase, Request};

use self::judge::{Matrix, Way, at_first_sight, judge, times};
use super::Panel;
use super::ask::{ask, begin};
use crate::cli::operate::{Ended, Operator};
use crate::cli::ui::Ui;

/// How far a leg is driven, as part of its stroke.
const STEP: f64 = 0.02;
/// How long the platform may take to its bias, and to arrive after a step.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long it may take until it runs.
const COMES: Duration = Duration::from_secs(2);
/// From arriving to reading: gauges and amplifiers lag.
const SETTLE: Duration = Duration::from_millis(100);
/// Readings of which the mean is taken.
const READINGS: u32 = 40;

/// Drives, measures, judges. The machine holds at the end, with the mode that it had.
pub(super) fn run<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    quiet: &Ui,
) -> Result<Value, Ended> {
    let no = |why: &str| Ended::Refused(why.to_owned());
    let (expected, jacobian, inverse) = {
        let panel = panel.borrow();
        let geometry = &panel.compiled.model.geometry;
        let expected = panel.compiled.ir.supervision.readings_per_leg;
        let expected = expected.ok_or_else(|| no("each leg has a gauge of its own: there is no platform to check"))?;
        let both = lower::leg_jacobian(geometry).zip(lower::inverse_jacobian(geometry));
        let (jacobian, inverse) = both.ok_or_else(|| no("the legs of the spec hold no platform"))?;
        (expected, jacobian, inverse)
    };
    if u64::from(operator.phase()) != Phase::Holding.word() {
        return Err(no(
            "the check begins with a machine that was armed and holds at rest: ramp down if it is not, then arm",
        ));
    }
    // Asked now: what the page knows may be of a check that was ended a moment ago.
    let gains = ask(operator, &Order::Gains(Vec::new()), quiet)?;
    let mode = gains["mode"].as_str().map(str::to_owned);
    let mode = mode.and_then(|mode| Order::parse(&format!("mode {mode}")).ok().flatten());
    panel.borrow_mut().check = json!({ "runs": true, "done": 0 });
    ask(operator, &Order::Mode(Wanted { terms: [false, true], law: Some(0) }), quiet)?;
    let step = STEP * panel.borrow().compiled.model.actuator.stroke;
    let mut way = Way::default();
    let measured = measure(operator, panel, quiet, &expected, [&jacobian, &inverse], step, &mut way);
    // Whatever came of it, it is to stand and to be as it was.
    operator.session.supervise(Request::Hold)?;
    operator.wait(Until::Phase(Phase::Holding), PATIENCE, quiet).or_else(|ended| match ended {
        // A machine that ramps down or is faulted does not hold.
        Ended::Fault(_) | Ended::Refused(_) => Ok(()),
        other => Err(other),
    })?;
    if let Some(mode) = mode {
        ask(operator, &mode, quiet)?;
    }
    // What is turned shows a platform that is far from its set-point: the supervisor holds it, and the way until then names it.
    let on_the_way = || at_first_sight(&expected, &way);
    let verdict = match measured {
        Ok(measured) => judge(&expected, &measured),
        Err(Ended::Fault(why)) => on_the_way().ok_or(Ended::Fault(why))?,
        Err(ended) => return Err(ended),
    };
    let (kind, advice) = if verdict.good {
        ("note", "")
    } else {
        ("error", "Ramp down, and mend what the check says before the loop is closed.")
    };
    let mut panel = panel.borrow_mut();
    panel.hall.note(kind, &format!("First-power check: {}", verdict.what), advice, None);
    panel.check = json!({ "runs": false, "verdict": verdict });
    Ok(json!(verdict))
}

/// Readings of the gauges (rows) per displacement of a leg (columns); `way` is what was seen before a leg was driven.
fn measure<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    quiet: &Ui,
    expected: &Matrix,
    [jacobian, inverse]: [&Matrix; 2],
    step: f64,
    way: &mut Way,
) -> Result<Matrix, Ended> {
    let motion = operator.motion().map_err(Ended::Refused)?.clone();
    let along = |leg: usize, standing: &[f64; 6]| -> Option<[f64; 6]> {
        let from = motion.platform(standing)?;
        motion.user(&core::array::from_fn(|axis| from[axis] + inverse[axis][leg] * step))
    };
    begin(operator, Request::Run)?;
    let since = Instant::now();
    let start = loop {
        heed(operator, panel)?;
        let place = operator.place()?;
        let runs = u64::from(place.phase) == Phase::Running.word();
        if runs {
            let shown = times(expected, &times(jacobian, &motion.platform(&place.pose).unwrap_or(place.pose)));
            way.seen(times(jacobian, &motion.platform(&place.target).unwrap_or(place.target)), shown);
            if place.status & BUSY == 0 {
                break place.target;
            }
        }
        let comes = u64::from(place.phase) == Phase::Holding.word() && since.elapsed() < COMES;
        if !runs && !comes || since.elapsed() > PATIENCE {
            return Err(Ended::Fault(format!(
                "the platform does not come to its bias: the machine is {}",
                operator.stands()
            )));
        }
    };
    let mut measured = [[0.0; 6]; 6];
    for leg in 0..6 {
        let before = readings(operator, panel, &motion, expected, jacobian)?;
        let to = along(leg, &start).ok_or_else(|| Ended::Refused("a leg has no room".to_owned()))?;
        operator.go(to)?;
        operator.wait(Until::Arrived, PATIENCE, quiet)?;
        let after = readings(operator, panel, &motion, expected, jacobian)?;
        for (row, (after, before)) in measured.iter_mut().zip(after.iter().zip(before)) {
            row[leg] = (after - before) / step;
        }
        operator.go(start)?;
        operator.wait(Until::Arrived, PATIENCE, quiet)?;
        panel.borrow_mut().check = json!({ "runs": true, "done": leg + 1 });
    }
    Ok(measured)
}

/// Looks, which serves the pages, and ends where one asks for it.
fn heed<P: Port + 'static>(operator: &mut Operator<P>, panel: &Rc<RefCell<Panel>>) -> Result<(), Ended> {
    operator.look()?;
    if std::mem::take(&mut panel.borrow_mut().hall.ends) {
        return Err(Ended::Refused("the check was ended".to_owned()));
    }
    std::thread::sleep(Duration::from_millis(2));
    Ok(())
}

/// The same, and ends where the machine does not run.
fn looked<P: Port + 'static>(operator: &mut Operator<P>, panel: &Rc<RefCell<Panel>>) -> Result<(), Ended> {
    heed(operator, panel)?;
    if u64::from(operator.phase()) != Phase::Running.word() {
        return Err(Ended::Fault(format!(
            "the machine is {}: gauges or legs are not as the spec says, or something holds the platform",
            operator.stands()
        )));
    }
    Ok(())
}

/// What the gauges show, m: the mean of some looks, from the pose that the controller makes of them.
fn readings<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    motion: &Motion,
    per_leg: &Matrix,
    jacobian: &Matrix,
) -> Result<[f64; 6], Ended> {
    let since = Instant::now();
    while since.elapsed() < SETTLE {
        looked(operator, panel)?;
    }
    let mut pose = [0.0; 6];
    for _ in 0..READINGS {
        looked(operator, panel)?;
        let place = operator.place()?;
        let from_rest = motion.platform(&place.pose).unwrap_or(place.pose);
        for (sum, value) in pose.iter_mut().zip(from_rest) {
            *sum += value / f64::from(READINGS);
        }
    }
    Ok(times(per_leg, &times(jacobian, &pose)))
}
