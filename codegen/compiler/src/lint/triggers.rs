//! Output lines against noise, speed and themselves.

use super::{Facts, Found, amount, figure};
use crate::lower::{pose_noise, triggers};
use specgen_language::diagnostic::codes;
use specgen_language::model::{Trigger, TriggerKind};
use specgen_runtime::trigger::MOST_STEPS;

/// The triggers of a kind, by their number.
fn of_kind<'a>(facts: &Facts<'a>, kinds: &[TriggerKind]) -> Vec<(usize, &'a Trigger)> {
    let task = facts.model.task_space.as_ref();
    let triggers = task.into_iter().flat_map(|task| task.triggers.iter().enumerate());
    triggers.filter(|(_, trigger)| kinds.contains(&trigger.kind)).collect()
}

/// rms of the pose by axis; none where gauges do not fix it, for which there is an error.
fn noise(facts: &Facts) -> Option<[f64; 6]> {
    pose_noise(facts.model).ok().flatten().map(|noise| noise.pose)
}

/// Its key of a length or an angle.
fn key(index: usize, trigger: &Trigger, name: &str) -> String {
    format!("trigger[{index}].{name}{}", if trigger.axis < 3 { "" } else { "_angle" })
}

/// Positions that are passed one after the other are more than one.
pub(super) fn more_than_one(facts: &Facts, found: &mut Found) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let (Some(start), Some(step)) = (trigger.start, trigger.step) else { continue };
        let stop = trigger.stop.unwrap_or(facts.model.workspace.bounds()[trigger.axis]);
        // One position is meant where start and stop are one.
        if stop <= start || step <= stop - start {
            continue;
        }
        found.add(
            codes::TRIGGER_SINGLE,
            &key(index, trigger, "step"),
            format!(
                "`step` of trigger[{index}] is {}, but from start to stop there are {}: only the first position gives a pulse",
                amount(trigger.axis, step),
                amount(trigger.axis, stop - start)
            ),
            "check the units of start, stop and step; write `stop` equal to `start` if one position is meant",
        );
    }
}

/// What may have a pulse does not end before it begins.
pub(super) fn some_at_all(facts: &Facts, found: &mut Found) {
    let triggers = facts.model.task_space.iter().flat_map(|task| task.triggers.iter().enumerate());
    for (index, trigger) in triggers {
        let Some(last) = trigger.last.filter(|last| *last < trigger.first) else { continue };
        found.add(
            codes::TRIGGER_SINGLE,
            &format!("trigger[{index}].last"),
            format!("`last` of trigger[{index}] is {last}, before its `first`, {}: it gives no pulse", trigger.first),
            "exchange the two, or leave `last` out",
        );
    }
}

/// Positions are apart by more than the hysteresis, and not so many that a single precision cannot tell them apart.
pub(super) fn steps_apart(facts: &Facts, found: &mut Found) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let (Some(noise), Some(step)) = (noise(facts), trigger.step) else { continue };
        let (hysteresis, shown) = (triggers::hysteresis(trigger, &noise), |value| amount(trigger.axis, value));
        let stop = trigger.stop.unwrap_or(facts.model.workspace.bounds()[trigger.axis]);
        let least = triggers::extent(&facts.model.workspace.bounds())[1];
        let problem = if step <= hysteresis {
            let fix = if 2.0 * hysteresis > least { 2.0 * hysteresis } else { least };
            (format!("not above its hysteresis of {}", shown(hysteresis)), fix)
        } else if step < least {
            let steps = (stop - trigger.start.unwrap_or(0.0)) / step;
            (
                format!(
                    "too fine: {} steps to stop, expected {MOST_STEPS} at most across the workspace",
                    figure(steps)
                ),
                least * 1.001,
            )
        } else {
            continue;
        };
        found.add(
            codes::TRIGGER_STEP,
            &key(index, trigger, "step"),
            format!("`step` of trigger[{index}] is {}, {}", shown(step), problem.0),
            &format!("write \"{}\" or more", shown(problem.1)),
        );
    }
}

/// The hysteresis is above the noise.
pub(super) fn above_noise(facts: &Facts, found: &mut Found) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position, TriggerKind::Level]) {
        let (Some(noise), Some(hysteresis)) = (noise(facts), trigger.hysteresis) else { continue };
        let quiet = triggers::QUIET * noise[trigger.axis];
        if hysteresis < quiet * (1.0 - 1e-9) {
            found.add(
                codes::TRIGGER_IN_NOISE,
                &key(index, trigger, "hysteresis"),
                format!(
                    "`hysteresis` of trigger[{index}] is {}, but the pose has {} of noise, rms",
                    amount(trigger.axis, hysteresis),
                    amount(trigger.axis, noise[trigger.axis])
                ),
                &format!("take it out, or write \"{}\" or more", amount(trigger.axis, 1.01 * quiet)),
            );
        }
    }
}

/// A pulse is over, and the line low for a tick, before the next position is passed.
pub(super) fn pulses_apart(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    let period = facts.model.timing.period;
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let Some(step) = trigger.step else { continue };
        let (ticks, speed) = (triggers::width(trigger, period), task.setpoint.speed[trigger.axis]);
        let between = step / speed / period;
        if f64::from(ticks + 1) > between {
            found.add(
                codes::TRIGGERS_MERGE,
                &format!("trigger[{index}].width"),
                format!(
                    "a pulse of trigger[{index}] takes {ticks} tick{} and one between, but at {}/s a position is passed every {} ticks",
                    if ticks == 1 { "" } else { "s" },
                    amount(trigger.axis, speed),
                    figure(between)
                ),
                &format!(
                    "a step of \"{}\" leaves time for it; or write a shorter width",
                    amount(trigger.axis, 1.01 * f64::from(ticks + 1) * speed * period)
                ),
            );
        }
    }
}
