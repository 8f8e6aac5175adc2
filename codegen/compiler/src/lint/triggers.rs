//! Triggers compared with noise, speed and their own keys.

use super::{Facts, Findings, amount, figure};
use crate::lower::{pose_noise, triggers};
use specgen_language::model::{Trigger, TriggerKind};
use specgen_runtime::trigger::MOST_STEPS;

lints! {
    rules: more_than_one, some_at_all, steps_apart, above_noise, pulses_apart;

    /// # W0877: a trigger with at most one pulse
    ///
    /// `step` of a trigger of kind "position" should not be longer than the distance
    /// from `start` to `stop`. `last` of any trigger should not be before its `first`.
    ///
    /// ## Why it matters
    ///
    /// There is then a pulse only at `start`, or none at all. Usually one of the values
    /// is in the wrong unit.
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

    /// # E0874: step of a trigger too small
    ///
    /// `step` of a trigger must be larger than its `hysteresis`, whose default is ten
    /// times the noise of the measured pose. From `start` to `stop` there may be at
    /// most a million steps.
    ///
    /// ## Why it matters
    ///
    /// A trigger position is armed again only when the pose has moved away from it by
    /// the hysteresis. With closer positions, noise would decide which of them give a
    /// pulse.
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
    /// `hysteresis` should be at least ten times the noise of the measured pose (rms)
    /// along the axis.
    ///
    /// ## Why it matters
    ///
    /// At rest near a trigger position, noise crosses it back and forth. A hysteresis
    /// of ten times the rms is exceeded by chance at most once in 10⁶ ticks. With less,
    /// noise gives several pulses at one position.
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
    /// Leave the key out: the default is ten times the noise.
    ///
    /// ```toml
    /// [[trigger]]
    /// name       = "camera"
    /// kind       = "position"
    /// start      = "-20 um"
    /// step       = "1 um"
    /// ```
    TRIGGER_IN_NOISE = "W0875";

    /// # W0876: pulses of a trigger overlap
    ///
    /// At the largest speed of moves, `control.setpoint.speed`, the pulse at one
    /// position should end before the next position is passed.
    ///
    /// ## Why it matters
    ///
    /// Each pulse has its own edge: the line is low for at least a tick before it. A
    /// position that is passed earlier gives no pulse and is counted as missed.
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

/// The triggers of these kinds, with their numbers.
fn of_kind<'a>(facts: &Facts<'a>, kinds: &[TriggerKind]) -> Vec<(usize, &'a Trigger)> {
    let task = facts.model.task_space.as_ref();
    let triggers = task.into_iter().flat_map(|task| task.triggers.iter().enumerate());
    triggers.filter(|(_, trigger)| kinds.contains(&trigger.kind)).collect()
}

/// rms noise of the pose by axis; none if the gauges do not determine the pose, which is an error of its own.
fn noise(facts: &Facts) -> Option<[f64; 6]> {
    pose_noise(facts.model).ok().flatten().map(|noise| noise.pose)
}

/// Key of a length, or of the angle on a rotation axis.
fn key(index: usize, trigger: &Trigger, name: &str) -> String {
    format!("trigger[{index}].{name}{}", if trigger.axis < 3 { "" } else { "_angle" })
}

/// Checks that a trigger has more than one position.
fn more_than_one(facts: &Facts, found: &mut Findings) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let (Some(start), Some(step)) = (trigger.start, trigger.step) else { continue };
        let stop = trigger.stop.unwrap_or(facts.model.workspace.bounds()[trigger.axis]);
        // If start and stop are equal, one position is intended.
        if stop <= start || step <= stop - start {
            continue;
        }
        let (given, way) = (amount(trigger.axis, step), amount(trigger.axis, stop - start));
        found.add(
            TRIGGER_SINGLE,
            &key(index, trigger, "step"),
            format!(
                "`step` of trigger[{index}] is {given}, but from start to stop it is only {way}: only the first position gives a pulse"
            ),
            "check the units of start, stop and step; set `stop` equal to `start` if one position is intended",
        );
    }
}

/// Checks that `last` is not before `first`.
fn some_at_all(facts: &Facts, found: &mut Findings) {
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

/// Checks that positions are further apart than the hysteresis, and few enough for single precision.
fn steps_apart(facts: &Facts, found: &mut Findings) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let (Some(noise), Some(step)) = (noise(facts), trigger.step) else { continue };
        let (hysteresis, shown) = (triggers::hysteresis(trigger, &noise), |value| amount(trigger.axis, value));
        let stop = trigger.stop.unwrap_or(facts.model.workspace.bounds()[trigger.axis]);
        let least = triggers::extent(&facts.model.workspace.bounds())[1];
        let problem = if step <= hysteresis {
            let fix = if 2.0 * hysteresis > least { 2.0 * hysteresis } else { least };
            (format!("not larger than its hysteresis of {}", shown(hysteresis)), fix)
        } else if step < least {
            let steps = (stop - trigger.start.unwrap_or(0.0)) / step;
            (
                format!(
                    "too small: {} steps to stop, but at most {MOST_STEPS} are possible across the workspace",
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

/// Checks that the hysteresis is above the noise.
fn above_noise(facts: &Facts, found: &mut Findings) {
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position, TriggerKind::Level]) {
        let (Some(noise), Some(hysteresis)) = (noise(facts), trigger.hysteresis) else { continue };
        let quiet = triggers::QUIET * noise[trigger.axis];
        if hysteresis < quiet * (1.0 - 1e-9) {
            let (given, rms) = (amount(trigger.axis, hysteresis), amount(trigger.axis, noise[trigger.axis]));
            found.add(
                TRIGGER_IN_NOISE,
                &key(index, trigger, "hysteresis"),
                format!("`hysteresis` of trigger[{index}] is {given}, but the measured pose has a noise of {rms} rms"),
                &format!("leave it out, or write \"{}\" or more", amount(trigger.axis, 1.01 * quiet)),
            );
        }
    }
}

/// Checks that a pulse has ended, and the line was low for a tick, before the next position is passed.
fn pulses_apart(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let period = facts.model.timing.period;
    for (index, trigger) in of_kind(facts, &[TriggerKind::Position]) {
        let Some(step) = trigger.step else { continue };
        let (ticks, speed) = (triggers::width(trigger, period), task.setpoint.speed[trigger.axis]);
        let between = step / speed / period;
        if f64::from(ticks + 1) > between {
            let (plural, fast) = (if ticks == 1 { "" } else { "s" }, amount(trigger.axis, speed));
            let between = figure(between);
            found.add(
                TRIGGERS_MERGE,
                &format!("trigger[{index}].width"),
                format!(
                    "a pulse of trigger[{index}] takes {ticks} tick{plural} plus one before the next, but at {fast}/s a position is passed every {between} ticks"
                ),
                &format!(
                    "a step of \"{}\" leaves enough time; or write a shorter width",
                    amount(trigger.axis, 1.01 * f64::from(ticks + 1) * speed * period)
                ),
            );
        }
    }
}
