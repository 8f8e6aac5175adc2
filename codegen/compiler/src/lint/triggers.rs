//! Output lines against noise, speed and themselves.

use super::{Facts, Found, amount, figure};
use crate::lower::{pose_noise, triggers};
use specgen_language::model::{Trigger, TriggerKind};
use specgen_runtime::trigger::MOST_STEPS;

lints! {
    rules: more_than_one, some_at_all, steps_apart, above_noise, pulses_apart;

    /// # W0877: a trigger that passes one position
    ///
    /// `step` of a trigger of kind "position" should not be longer than the way from
    /// `start` to `stop`, and `last` of any trigger not lie before its `first`.
    ///
    /// ## Why it matters
    ///
    /// There is then a pulse at `start` and at no other position: one of the three is
    /// in another unit.
    ///
    /// ## Example
    ///
    /// `specs/features/triggers.toml` with
    ///
    /// ```diff
    /// @@ [[trigger]] @@
    /// -step  = "1 um"
    /// +step  = "1 mm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of start, stop and step.
    ///
    /// ```toml
    /// step  = "1 um"
    /// ```
    TRIGGER_SINGLE = "W0877";

    /// # E0874: positions of a trigger within its hysteresis
    ///
    /// `step` of a trigger must be above its `hysteresis`, which is ten times the
    /// noise of the measured pose where the spec does not say it, and there are at most
    /// a million steps from `start` to `stop`.
    ///
    /// ## Why it matters
    ///
    /// A position that was passed counts again only after the pose was away from it by
    /// the hysteresis. With positions closer than that, noise would decide which of
    /// them give a pulse.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[[trigger]]
    /// +name       = "camera"
    /// +kind       = "position"
    /// +start      = "-20 um"
    /// +step       = "40 nm"
    /// +hysteresis = "50 nm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Write a larger step, or a smaller hysteresis that is still above the noise.
    ///
    /// ```toml
    /// [[trigger]]
    /// name       = "camera"
    /// kind       = "position"
    /// start      = "-20 um"
    /// step       = "1 um"
    /// hysteresis = "50 nm"
    /// ```
    TRIGGER_STEP = "E0874";

    /// # W0875: hysteresis of a trigger within the noise
    ///
    /// A `hysteresis` below ten times the noise of the measured pose (rms) along the
    /// axis is reported.
    ///
    /// ## Why it matters
    ///
    /// The pose is measured with noise: at rest near a position it passes to and fro.
    /// A hysteresis of ten times its rms is passed by chance once in 10⁶ ticks or
    /// less; below that the line shows the noise, and one position gives several
    /// pulses.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[[trigger]]
    /// +name       = "camera"
    /// +kind       = "position"
    /// +start      = "-20 um"
    /// +step       = "1 um"
    /// +hysteresis = "2 nm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Leave the key out: then it is ten times the noise.
    ///
    /// ```toml
    /// [[trigger]]
    /// name       = "camera"
    /// kind       = "position"
    /// start      = "-20 um"
    /// step       = "1 um"
    /// ```
    TRIGGER_IN_NOISE = "W0875";

    /// # W0876: pulses of a trigger run into one another
    ///
    /// At the largest speed of moves, `control.setpoint.speed`, a position is passed
    /// while the pulse of the one before lasts.
    ///
    /// ## Why it matters
    ///
    /// Each pulse has an edge of its own: the line is low for a tick before the next.
    /// A position that is passed before that gives no pulse, and is counted as missed.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[[trigger]]
    /// +name  = "camera"
    /// +kind  = "position"
    /// +start = "-20 um"
    /// +step  = "1 um"
    /// +width = "20 ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Write a shorter width or a larger step.
    ///
    /// ```toml
    /// [[trigger]]
    /// name  = "camera"
    /// kind  = "position"
    /// start = "-20 um"
    /// step  = "1 um"
    /// width = "1 ms"
    /// ```
    TRIGGERS_MERGE = "W0876";
}

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
fn more_than_one(facts: &Facts, found: &mut Found) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let (Some(start), Some(step)) = (trigger.start, trigger.step) else { continue };
        let stop = trigger.stop.unwrap_or(facts.model.workspace.bounds()[trigger.axis]);
        // One position is meant where start and stop are one.
        if stop <= start || step <= stop - start {
            continue;
        }
        found.add(
            TRIGGER_SINGLE,
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
fn some_at_all(facts: &Facts, found: &mut Found) {
    let triggers = facts.model.task_space.iter().flat_map(|task| task.triggers.iter().enumerate());
    for (index, trigger) in triggers {
        let Some(last) = trigger.last.filter(|last| *last < trigger.first) else { continue };
        found.add(
            TRIGGER_SINGLE,
            &format!("trigger[{index}].last"),
            format!("`last` of trigger[{index}] is {last}, before its `first`, {}: it gives no pulse", trigger.first),
            "exchange the two, or leave `last` out",
        );
    }
}

/// Positions are apart by more than the hysteresis, and not so many that a single precision cannot tell them apart.
fn steps_apart(facts: &Facts, found: &mut Found) {
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
            TRIGGER_STEP,
            &key(index, trigger, "step"),
            format!("`step` of trigger[{index}] is {}, {}", shown(step), problem.0),
            &format!("write \"{}\" or more", shown(problem.1)),
        );
    }
}

/// The hysteresis is above the noise.
fn above_noise(facts: &Facts, found: &mut Found) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position, TriggerKind::Level]) {
        let (Some(noise), Some(hysteresis)) = (noise(facts), trigger.hysteresis) else { continue };
        let quiet = triggers::QUIET * noise[trigger.axis];
        if hysteresis < quiet * (1.0 - 1e-9) {
            found.add(
                TRIGGER_IN_NOISE,
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
fn pulses_apart(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    let period = facts.model.timing.period;
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let Some(step) = trigger.step else { continue };
        let (ticks, speed) = (triggers::width(trigger, period), task.setpoint.speed[trigger.axis]);
        let between = step / speed / period;
        if f64::from(ticks + 1) > between {
            found.add(
                TRIGGERS_MERGE,
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
