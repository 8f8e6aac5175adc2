//! Limits of moves and streams compared with workspace, tick and legs.

use super::{AXES, Facts, Findings, amount, figure};
use specgen_language::model::SetpointRules;

lints! {
    rules: rotations_beside_translations, stops_take_ticks, correction_moves_codes, moves_within_slew, moves_end,
        limits_bind, stream_limit_binds, streams_keep_up, streams_within_slew, workspace_is_used;

    /// # W0887: limits of rotations and translations far apart
    ///
    /// Limits of speed, acceleration and jerk of rotations should be within a factor of
    /// ten of those of translations, as motion at the joints or as fractions of the
    /// workspace.
    ///
    /// ## Why it matters
    ///
    /// Degrees instead of milliradians are 17 times too fast, radians instead of
    /// degrees 57 times. That may violate no other limit, but it shakes the platform.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -speed        = ["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// +speed        = ["100 um/s", "100 um/s", "100 um/s", "1 deg/s", "1 deg/s", "1 deg/s"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of the last three.
    ///
    /// ```toml
    /// speed        = ["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// ```
    LIMITS_APART = "W0887";

    /// # W0840: moves beyond the slew rate
    ///
    /// At `control.setpoint.speed` no leg should need more than `actuator.slew_rate`.
    ///
    /// ## Why it matters
    ///
    /// A move at that speed runs into the slew limit and lags its profile.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -speed        = ["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// +speed        = ["100 mm/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check mm/s against um/s, and V/ms against V/s.
    ///
    /// ```toml
    /// speed        = ["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// ```
    MOVE_BEYOND_SLEW = "W0840";

    /// # W0841: moves that take minutes
    ///
    /// A move across the workspace at `control.setpoint.speed` should take less than
    /// two minutes.
    ///
    /// ## Why it matters
    ///
    /// It is usually um/s written for mm/s.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -speed        = ["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// +speed        = ["100 nm/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of speed and workspace.
    ///
    /// ```toml
    /// speed        = ["100 um/s", "100 um/s", "100 um/s", "1 mrad/s", "1 mrad/s", "1 mrad/s"]
    /// ```
    MOVE_SLOW = "W0841";

    /// # W0842: a limit of moves without effect
    ///
    /// Within the workspace, moves should reach the limits of speed, acceleration and
    /// jerk, and reaching them should take more than a tick. A stop should take more
    /// than a tick. A correction should be at least ten codes of the converter.
    ///
    /// ## Why it matters
    ///
    /// A limit that is reached within a tick, or never, has no effect. It is usually
    /// wrong by a factor of 1000.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -acceleration = ["10 mm/s^2", "10 mm/s^2", "10 mm/s^2", "100 mrad/s^2", "100 mrad/s^2", "100 mrad/s^2"]
    /// +acceleration = ["10 m/s^2", "10 mm/s^2", "10 mm/s^2", "100 mrad/s^2", "100 mrad/s^2", "100 mrad/s^2"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Choose speed / acceleration and acceleration / jerk of some ten ticks.
    ///
    /// ```toml
    /// acceleration = ["10 mm/s^2", "10 mm/s^2", "10 mm/s^2", "100 mrad/s^2", "100 mrad/s^2", "100 mrad/s^2"]
    /// ```
    LIMIT_WITHOUT_EFFECT = "W0842";

    /// # W0843: stream speed limit without effect
    ///
    /// At `control.setpoint.stream_speed` a stream should not be able to cross the
    /// workspace in one tick.
    ///
    /// ## Why it matters
    ///
    /// The limit protects the machine from jumps in the host's set-points. A limit this
    /// high lets every jump pass.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -stream_speed = ["5 mm/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// +stream_speed = ["5 m/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Write the speed of your paths plus some reserve.
    ///
    /// ```toml
    /// stream_speed = ["5 mm/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// ```
    STREAM_UNCHECKED = "W0843";

    /// # W0867: streams much slower than moves
    ///
    /// On no axis should `control.setpoint.stream_speed` be less than a tenth of
    /// `control.setpoint.speed`.
    ///
    /// ## Why it matters
    ///
    /// Streams are meant for fast set-points. A limit far below that of moves probably
    /// has the wrong unit, and every faster stream is refused.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control.setpoint] @@
    /// -stream_speed = ["5 mm/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// +stream_speed = ["5 um/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check um/s against mm/s.
    ///
    /// ```toml
    /// stream_speed = ["5 mm/s", "5 mm/s", "5 mm/s", "50 mrad/s", "50 mrad/s", "50 mrad/s"]
    /// ```
    STREAM_SLOW = "W0867";

    /// # W0844: a tiny workspace bound
    ///
    /// A bound should be more than 0.5 % of the travel that the legs give this axis.
    ///
    /// ## Why it matters
    ///
    /// It is usually nm written for um, or urad for mrad. Nearly every set-point on
    /// that axis would be refused.
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [workspace] @@
    /// -translation = ["40 um", "40 um", "40 um"]
    /// +translation = ["40 nm", "40 um", "40 um"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit.
    ///
    /// ```toml
    /// translation = ["40 um", "40 um", "40 um"]
    /// ```
    WORKSPACE_TINY = "W0844";
}

/// Longest plausible move across the workspace, s.
const LONGEST_MOVE: f64 = 120.0;
/// A limit that is reached only after this many workspace widths is never reached.
const NEVER: f64 = 4.0;
/// Ticks within which a limit is reached at once.
const WITHIN_TICK: f64 = 1.0;
/// Least stream speed, as a share of the speed of moves.
const SLOWEST_STREAM: f64 = 0.1;
/// Least bound, as a share of the travel.
const SMALLEST_USE: f64 = 5e-3;
/// Largest ratio of rotations to translations, both at the joints and relative to the workspace. Degrees for milliradians are a
/// factor of 17, radians for degrees 57.
const APART: f64 = 10.0;
/// Least correction, in codes of the converter.
const FEWEST_CODES: f64 = 10.0;

fn rules<'a>(facts: &Facts<'a>) -> Option<&'a SetpointRules> {
    facts.model.task_space.as_ref().map(|task| &task.setpoint)
}

/// Width of the workspace, m or rad.
fn way(facts: &Facts, axis: usize) -> f64 {
    2.0 * facts.model.workspace.bounds()[axis]
}

/// Checks the largest speed of moves against the slew rate.
fn moves_within_slew(facts: &Facts, found: &mut Findings) {
    let (Some(rules), Some(legs)) = (rules(facts), &facts.legs) else { return };
    let actuator = &facts.model.actuator;
    for (axis, speed) in rules.speed.into_iter().enumerate() {
        let slew = legs.steepest(axis) * speed / actuator.leg_gain();
        if slew <= actuator.slew_rate {
            continue;
        }
        let (fast, name, needed) = (amount(axis, speed), AXES[axis], figure(slew * 1e-3));
        let slew_rate = figure(actuator.slew_rate * 1e-3);
        found.add(
            MOVE_BEYOND_SLEW,
            &format!("control.setpoint.speed[{axis}]"),
            format!(
                "a speed of {fast}/s along {name} needs {needed} V/ms, but `actuator.slew_rate` is {slew_rate} V/ms"
            ),
            &format!(
                "at most {}/s is within the slew rate; check the units of both",
                amount(axis, speed * actuator.slew_rate / slew)
            ),
        );
    }
}

/// Checks how long a move across the workspace takes.
fn moves_end(facts: &Facts, found: &mut Findings) {
    let Some(rules) = rules(facts) else { return };
    for (axis, speed) in rules.speed.into_iter().enumerate() {
        let time = way(facts, axis) / speed;
        if time <= LONGEST_MOVE {
            continue;
        }
        let (speed, name, seconds) = (amount(axis, speed), AXES[axis], figure(time));
        found.add(
            MOVE_SLOW,
            &format!("control.setpoint.speed[{axis}]"),
            format!("at {speed}/s a move across the workspace along {name} takes {seconds} s"),
            "check the units of `control.setpoint.speed` and [workspace]",
        );
    }
}

/// Checks that speed, acceleration and jerk are each reached, but not within a tick.
#[allow(clippy::needless_range_loop)] // Axes and legs by number, as in the equations.
fn limits_bind(facts: &Facts, found: &mut Findings) {
    let Some(rules) = rules(facts) else { return };
    let tick = facts.model.timing.period;
    for axis in 0..6 {
        let (speed, acceleration, jerk) = (rules.speed[axis], rules.acceleration[axis], rules.jerk[axis]);
        let shown = |value: f64, per: &str| format!("{}/{per}", amount(axis, value));
        let mut say = |name: &str, value: String, what: String| {
            found.add(
                LIMIT_WITHOUT_EFFECT,
                &format!("control.setpoint.{name}[{axis}]"),
                format!("a limit of {value} on {} {what}", AXES[axis]),
                &format!("check the unit of `control.setpoint.{name}` against the other two limits of moves"),
            );
        };
        if speed / acceleration < WITHIN_TICK * tick {
            say(
                "acceleration",
                shown(acceleration, "s^2"),
                format!("has no effect: a speed of {} is reached within a tick", shown(speed, "s")),
            );
        } else if speed * speed / acceleration > NEVER * way(facts, axis) {
            say(
                "acceleration",
                shown(acceleration, "s^2"),
                format!("is so low that a speed of {} is never reached in the workspace", shown(speed, "s")),
            );
        }
        if acceleration / jerk < WITHIN_TICK * tick {
            say(
                "jerk",
                shown(jerk, "s^3"),
                format!("has no effect: an acceleration of {} is reached within a tick", shown(acceleration, "s^2")),
            );
        } else if acceleration * acceleration / jerk > 50.0 * NEVER * speed {
            let (most, below) = (shown(acceleration, "s^2"), shown(speed, "s"));
            say(
                "jerk",
                shown(jerk, "s^3"),
                format!("is so low that an acceleration of {most} is never reached below a speed of {below}"),
            );
        }
    }
}

/// The median of three.
fn middle(mut values: [f64; 3]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[1]
}

/// Compares the limits of rotations and translations.
fn rotations_beside_translations(facts: &Facts, found: &mut Findings) {
    let Some(rules) = rules(facts) else { return };
    let radius = facts.model.geometry.joint_radius();
    let bounds = facts.model.workspace.bounds();
    for (name, limits, unit) in [
        ("speed", rules.speed, ["mm/s", "rad/s"]),
        ("acceleration", rules.acceleration, ["mm/s^2", "rad/s^2"]),
        ("jerk", rules.jerk, ["mm/s^3", "rad/s^3"]),
        ("stream_speed", rules.stream_speed, ["mm/s", "rad/s"]),
    ] {
        let key = format!("control.setpoint.{name}");
        let of = |first: usize, each: &dyn Fn(usize) -> f64| middle(core::array::from_fn(|k| each(first + k)));
        let along = of(0, &|axis| limits[axis]);
        let about = of(3, &|axis| limits[axis]);
        // A locked axis has no travel.
        let part = |axis: usize| if bounds[axis] > 0.0 { limits[axis] / bounds[axis] } else { f64::INFINITY };
        let ratios = [radius * about / along, of(3, &part) / of(0, &part)];
        let faster = ratios.iter().all(|ratio| *ratio > APART);
        let slower = ratios.iter().all(|ratio| *ratio < 1.0 / APART);
        if !found.model.spans.contains_key(&key) || !(faster || slower) {
            continue;
        }
        let [angle, at_joints, way] = [about, radius * about * 1e3, along * 1e3].map(figure);
        let [length, turn] = unit;
        let times = figure(if faster { ratios[0] } else { 1.0 / ratios[0] });
        let more = if faster { "less" } else { "more" };
        found.add(
            LIMITS_APART,
            &format!("{key}[3]"),
            format!(
                "rotations are limited to {angle} {turn}, which is {at_joints} {length} at the joints; translations are limited to {way} {length}, {times} times {more}"
            ),
            &format!("check the units of `{key}`: deg, mrad and rad, um and mm"),
        );
    }
}

/// Checks that a stop takes more than a tick.
fn stops_take_ticks(facts: &Facts, found: &mut Findings) {
    let Some(rules) = rules(facts) else { return };
    let Some(limits) = rules.stop_acceleration else { return };
    let tick = facts.model.timing.period;
    for (axis, limit) in limits.into_iter().enumerate() {
        let [speed, stream] = [rules.speed[axis], rules.stream_speed[axis]];
        let fastest = if speed > stream { speed } else { stream };
        if fastest / limit >= WITHIN_TICK * tick {
            continue;
        }
        let (limit, name, speed) = (amount(axis, limit), AXES[axis], amount(axis, fastest));
        found.add(
            LIMIT_WITHOUT_EFFECT,
            &format!("control.setpoint.stop_acceleration[{axis}]"),
            format!(
                "a limit of {limit}/s^2 on {name} has no effect: it stops a speed of {speed}/s within a tick"
            ),
            "check the unit of `control.setpoint.stop_acceleration`, or leave it out: the compiler derives it from the modes",
        );
        return;
    }
}

/// Checks that a correction is more than a few codes.
fn correction_moves_codes(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    let Some(correction) = model.task_space.as_ref().and_then(|task| task.correction) else { return };
    let [low, high] = model.dac.range;
    let code = (high - low) / (libm::exp2(f64::from(model.dac.bits)) - 1.0) * model.actuator.leg_gain();
    if correction >= FEWEST_CODES * code {
        return;
    }
    let [most, step] = [correction * 1e9, code * 1e9].map(figure);
    found.add(
        LIMIT_WITHOUT_EFFECT,
        "control.correction",
        format!("a correction of at most {most} nm has no effect: one code of the converter moves a leg by {step} nm"),
        "check the unit (nm or um)",
    );
}

/// Checks that the stream speed limit prevents jumps.
fn stream_limit_binds(facts: &Facts, found: &mut Findings) {
    let Some(rules) = rules(facts) else { return };
    for (axis, speed) in rules.stream_speed.into_iter().enumerate() {
        let step = speed * facts.model.timing.period;
        if step <= way(facts, axis) {
            continue;
        }
        let (speed, step, name) = (amount(axis, speed), amount(axis, step), AXES[axis]);
        let workspace = amount(axis, way(facts, axis));
        found.add(
            STREAM_UNCHECKED,
            &format!("control.setpoint.stream_speed[{axis}]"),
            format!(
                "at {speed}/s a stream may jump by {step} along {name} in a tick, more than the whole workspace of {workspace}"
            ),
            "a jump across the workspace would be accepted: check the unit",
        );
    }
}

/// Checks that streams may be about as fast as moves.
fn streams_keep_up(facts: &Facts, found: &mut Findings) {
    let Some(rules) = rules(facts) else { return };
    for (axis, stream) in rules.stream_speed.into_iter().enumerate() {
        if stream >= SLOWEST_STREAM * rules.speed[axis] {
            continue;
        }
        let (streamed, name, own) = (amount(axis, stream), AXES[axis], amount(axis, rules.speed[axis]));
        found.add(
            STREAM_SLOW,
            &format!("control.setpoint.stream_speed[{axis}]"),
            format!("streamed set-points may move at {streamed}/s along {name}, but moves at {own}/s"),
            "check the units of `control.setpoint.stream_speed` and `control.setpoint.speed`: um/s or mm/s",
        );
    }
}

/// Checks the largest speed of streams against the slew rate. If most axes are beyond it, the slew rate is suspected.
fn streams_within_slew(facts: &Facts, found: &mut Findings) {
    let (Some(rules), Some(legs)) = (rules(facts), &facts.legs) else { return };
    let actuator = &facts.model.actuator;
    let slews: [f64; 6] =
        core::array::from_fn(|axis| legs.steepest(axis) * rules.stream_speed[axis] / actuator.leg_gain());
    let beyond: Vec<usize> = (0..6).filter(|axis| slews[*axis] > actuator.slew_rate).collect();
    let Some(worst) = beyond.iter().copied().reduce(|a, b| if slews[b] > slews[a] { b } else { a }) else { return };
    let key = if beyond.len() > 3 {
        "actuator.slew_rate".to_owned()
    } else {
        format!("control.setpoint.stream_speed[{worst}]")
    };
    let (name, speed, needed) = (AXES[worst], amount(worst, rules.stream_speed[worst]), figure(slews[worst] * 1e-3));
    let slew_rate = figure(actuator.slew_rate * 1e-3);
    found.add(
        MOVE_BEYOND_SLEW,
        &key,
        format!("a stream along {name} at {speed}/s needs {needed} V/ms, but `actuator.slew_rate` is {slew_rate} V/ms"),
        "check the units of `actuator.slew_rate` (V/ms or V/s) and `control.setpoint.stream_speed`",
    );
}

/// Checks for a bound that uses almost none of the travel.
#[allow(clippy::needless_range_loop)] // Axes and legs by number, as in the equations.
fn workspace_is_used(facts: &Facts, found: &mut Findings) {
    let Some(legs) = &facts.legs else { return };
    let stroke = facts.model.actuator.stroke;
    for axis in 0..6 {
        let bound = 0.5 * way(facts, axis);
        let reached = 0.5 * stroke / legs.steepest(axis);
        // Zero locks the axis.
        if bound == 0.0 || bound >= SMALLEST_USE * reached {
            continue;
        }
        let key = if axis < 3 {
            format!("workspace.translation[{axis}]")
        } else {
            format!("workspace.rotation[{}]", axis - 3)
        };
        let (name, bound, reached) = (AXES[axis], amount(axis, bound), amount(axis, reached));
        found.add(
            WORKSPACE_TINY,
            &key,
            format!("{name} is bounded to ±{bound}, but the legs reach ±{reached}"),
            "check the unit; write 0 to lock an axis",
        );
    }
}
