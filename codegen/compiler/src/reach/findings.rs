//! Findings about reach, and the text of `specgen check`.

use std::fmt::Write as _;

use super::{PathReach, ROOM, Reach};
use crate::figure::{figure, fixed};
use crate::lower;
use specgen_language::diagnostic::{Diagnostic, Severity, codes};
use specgen_language::model::{Model, SetpointKind};

const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];
/// Unit and factor of an axis in messages.
const fn unit(axis: usize) -> (&'static str, f64) {
    if axis < 3 { ("um", 1e6) } else { ("urad", 1e6) }
}

/// Findings about bias and workspace; `bias` is the path that stays at the bias.
pub(super) fn of(model: &Model, reach: &Reach, bias: &PathReach) -> Vec<Diagnostic> {
    let mut findings = Vec::new();
    findings.extend(of_bias(model, reach, bias));
    findings.extend(of_bounds(model, reach.stroke, |axis| reach.axes[axis].from_middle));
    findings.extend(of_condition(model, reach));
    findings
}

/// Findings about legs with their own gauges.
pub(super) fn of_legs(model: &Model, reach: &Reach) -> Vec<Diagnostic> {
    let bounds = of_bounds(model, reach.stroke, |axis| reach.axes[axis].from_middle);
    bounds.into_iter().chain(of_gauge_ends(model, reach).filter(is_warning)).chain(of_condition(model, reach)).collect()
}

/// Notes about them.
pub(super) fn notes_of_legs(model: &Model, reach: &Reach) -> Vec<Diagnostic> {
    of_gauge_ends(model, reach).filter(|one| !is_warning(one)).into_iter().collect()
}

fn is_warning(finding: &Diagnostic) -> bool {
    finding.severity > Severity::Note
}

/// Least plausible range of a gauge, as a share of its leg's stroke.
const LEAST_SEEN: f64 = 0.5;

/// Checks whether a leg moves beyond the range of its gauge.
fn of_gauge_ends(model: &Model, reach: &Reach) -> Option<Diagnostic> {
    let [low, high] = model.sensor.range;
    if low <= 0.0 && high >= reach.stroke {
        return None;
    }
    let item = usize::from(low <= 0.0);
    let seen = if high < reach.stroke { high } else { reach.stroke } - if low > 0.0 { low } else { 0.0 };
    // The paper's gauge covers four fifths; a much smaller range is in the wrong unit.
    let code = if seen < LEAST_SEEN * reach.stroke { codes::SENSOR_RANGE } else { codes::GAUGE_SHORT_OF_STROKE };
    let (low, high, stroke) = (fixed(low * 1e6, 3), fixed(high * 1e6, 3), reach.stroke * 1e6);
    Some(Diagnostic::at(&model.spans, &[&format!("sensor.range[{item}]"), "sensor.range", "sensor"], code,
        format!(
            "the gauge of a leg reads {low} um to {high} um, but the leg moves from 0 to {stroke:.3} um"
        ),
        "a leg beyond the range of its gauge is a gauge fault: keep set-points within the range, or use a gauge that covers the whole stroke; check the unit of `sensor.range`".to_owned(),
    ))
}

/// Largest condition number without a warning.
const POOREST: f64 = 30.0;

fn of_condition(model: &Model, reach: &Reach) -> Option<Diagnostic> {
    let conditioning = &reach.conditioning;
    if conditioning.worst_bound <= POOREST {
        return None;
    }
    Some(Diagnostic::at(&model.spans, &["geometry.height", "geometry"], codes::CONDITION_POOR,
        format!(
            "the condition number of the legs is {} at rest {}",
            of_number(conditioning.at_rest, 1),
            if conditioning.worst_bound < f64::MAX {
                format!("and may reach {} in the workspace", of_number(conditioning.worst_bound, 1))
            } else {
                "and has no bound: a pose of the workspace may be singular".to_owned()
            }
        ),
        "make the height comparable to the radii, close the joint pairs (small base_angle and platform_angle), or reduce [workspace]".to_owned(),
    ))
}

/// A condition number; in powers of ten if it is very large.
fn of_number(value: f64, decimals: usize) -> String {
    if value < 1e6 { format!("{value:.decimals$}") } else { format!("{value:.1e}") }
}

fn of_bias(model: &Model, reach: &Reach, bias: &PathReach) -> Option<Diagnostic> {
    const KEYS: [&str; 4] = ["control.setpoint.bias[2]", "control.setpoint.bias", "control.setpoint", "control"];
    let [low, high] = reach.at_bias;
    if beyond(reach.stroke, reach.at_bias) {
        let help = advice(bias, "bias");
        let message = format!(
            "at the bias the legs would be at {:.3} um to {:.3} um, but they move between 0 and {:.3} um{}",
            low * 1e6,
            high * 1e6,
            reach.stroke * 1e6,
            if reach.stroke < model.actuator.stroke {
                format!(": {}", of_table(model, reach.stroke))
            } else {
                String::new()
            }
        );
        return Some(Diagnostic::at(&model.spans, &KEYS, codes::BIAS_UNREACHABLE, message, help));
    }
    let room = ROOM * reach.stroke;
    if low >= room && high <= reach.stroke - room {
        return None;
    }
    let (place, stroke) = (if low < room { low * 1e6 } else { high * 1e6 }, reach.stroke * 1e6);
    let message = format!("at the bias a leg is at {place:.3} um of {stroke:.3} um: there is no room for corrections");
    let middle = 0.5 * (reach.axes[2].from_middle[0] + reach.axes[2].from_middle[1]);
    let help = format!("move the bias towards the middle of the strokes, where z is {:.1} um", middle * 1e6);
    Some(Diagnostic::at(&model.spans, &KEYS, codes::NO_ROOM, message, help))
}

/// Bounds that no pose reaches. `stroke`: travel of every leg, m; `from_middle`: travel of an axis alone from the middle of the
/// strokes, m or rad. Legs with displacement set-points have no workspace.
pub(super) fn of_bounds(model: &Model, stroke: f64, from_middle: impl Fn(usize) -> [f64; 2]) -> Vec<Diagnostic> {
    if model.task_space.is_none() && model.controller.setpoint == SetpointKind::Leg {
        return Vec::new();
    }
    let bounds = model.workspace.bounds();
    let each = (0..6).filter_map(|axis| of_axis(model, stroke, axis, bounds[axis], from_middle(axis)));
    each.collect()
}

fn of_axis(model: &Model, stroke: f64, axis: usize, declared: f64, [low, high]: [f64; 2]) -> Option<Diagnostic> {
    let furthest = if -low > high { -low } else { high };
    if declared <= furthest * (1.0 + 1e-9) {
        return None;
    }
    let (table, item) = if axis < 3 { ("workspace.translation", axis) } else { ("workspace.rotation", axis - 3) };
    let key = format!("{table}[{item}]");
    let (unit, scale) = unit(axis);
    // Rounded down, so that the number shown is itself accepted.
    let shown = |value: f64| libm::floor(value * scale * 100.0) / 100.0;
    let seen = lower::seen(model).map_or(f64::INFINITY, |seen| seen[axis]);
    let most = if seen < furthest {
        format!("at most {} {unit}, the range of the gauges (the legs reach {} {unit})", shown(seen), shown(furthest))
    } else {
        format!("at most {} {unit}", shown(furthest))
    };
    // The table of a leg may cover less than the stroke of the data sheet.
    let (code, binds, way_out) = if stroke < model.actuator.stroke {
        (codes::AXIS_UNREACHABLE, of_table(model, stroke), "use a record that covers the whole stroke")
    } else {
        let binds = format!("the stroke is {} um", figure(stroke * 1e6));
        (codes::WORKSPACE_UNREACHABLE, binds, "use legs with more stroke")
    };
    let (axis, declared, low, high) = (AXES[axis], declared * scale, fixed(low * scale, 2), fixed(high * scale, 2));
    let mut finding = Diagnostic::at(
        &model.spans,
        &[&key, table, "workspace"],
        code,
        format!(
            "no pose reaches |{axis}| = {declared:.2} {unit}: {binds}, and from its middle this axis alone moves from {low} to {high} {unit}"
        ),
        format!("{most}; check the unit, or {way_out}"),
    );
    // Measured legs are what they are; a declared stroke may be the mistake.
    let is_measured = stroke < model.actuator.stroke && finding.key == key;
    finding.replacement =
        is_measured.then(|| format!("\"{} {unit}\"", shown(if seen < furthest { seen } else { furthest })));
    Some(finding)
}

/// Explains that the identified table limits the travel, not the declared stroke.
fn of_table(model: &Model, stroke: f64) -> String {
    let [end, stroke] = [stroke * 1e6, model.actuator.stroke * 1e6].map(figure);
    format!("the identified hysteresis ends at {end} um, before the stroke of {stroke} um (`actuator.stroke`)")
}

/// The finding about a path that is out of reach.
pub(super) fn of_path(model: &Model, stroke: f64, [key, name]: [&str; 2], path: &PathReach) -> Option<Diagnostic> {
    if path.poses == 0 || !beyond(stroke, path.displacement) {
        return None;
    }
    let (lowest, highest, end) = (path.displacement[0] * 1e6, path.displacement[1] * 1e6, stroke * 1e6);
    let why = if stroke < model.actuator.stroke { format!(": {}", of_table(model, stroke)) } else { String::new() };
    let message = format!(
        "`{name}` needs leg displacements from {lowest:.3} um to {highest:.3} um, but the legs move between 0 and {end:.3} um{why}"
    );
    let section = key.split('.').next().unwrap_or(key);
    Some(Diagnostic::at(
        &model.spans,
        &[key, section],
        codes::TRAJECTORY_UNREACHABLE,
        message,
        advice(path, "control.setpoint.bias"),
    ))
}

/// Whether a range is beyond the ends of the strokes by more than rounding; true for NaN.
fn beyond(stroke: f64, [low, high]: [f64; 2]) -> bool {
    let inside = low >= -1e-9 * stroke && high <= (1.0 + 1e-9) * stroke;
    !inside
}

fn advice(path: &PathReach, what: &str) -> String {
    match path.shift {
        // Rounded inwards.
        Some([low, high]) => format!(
            "add {} um to {} um to z of {what} to bring it within reach",
            libm::ceil(low * 1e8) / 100.0,
            libm::floor(high * 1e8) / 100.0
        ),
        None => format!("no z of {what} brings it within reach of this stroke; check its units, or reduce it"),
    }
}

/// The reach as text for `specgen check`. `biased`: set-points are relative to a bias, else to rest.
pub fn describe(reach: &Reach, biased: bool) -> String {
    // Rounding errors of a bound at zero are not shown as -0.0.
    let tenths = |value: f64| libm::round(value * 10.0) / 10.0 + 0.0;
    let mut text = String::new();
    // Writing to a String cannot fail.
    let (stroke, from) = (reach.stroke * 1e6, if biased { "the bias" } else { "rest" });
    let _ = writeln!(
        text,
        "  reach of one axis alone, um and urad ({stroke:.1} um legs): from the middle of the strokes | from {from}"
    );
    for (axis, one) in reach.axes.iter().enumerate() {
        let scale = unit(axis).1;
        let (axis, low, high) = (AXES[axis], tenths(one.from_middle[0] * scale), tenths(one.from_middle[1] * scale));
        let (from, to) = (tenths(one.from_bias[0] * scale), tenths(one.from_bias[1] * scale));
        let declared = one.declared * scale;
        let _ = writeln!(
            text,
            "    {axis:<3} {low:>9.1} to {high:>8.1} | {from:>9.1} to {to:>8.1}   (declared ±{declared:.1})"
        );
    }
    if biased {
        let (lowest, highest, share) = (reach.at_bias[0] * 1e6, reach.at_bias[1] * 1e6, reach.share * 100.0);
        let _ = writeln!(
            text,
            "  at the bias the legs are at {lowest:.1} to {highest:.1} um; all corners of {share:.1} % of the declared workspace around it are within reach"
        );
    }
    let conditioning = &reach.conditioning;
    let _ = writeln!(
        text,
        "  condition of J {} at rest, {} at worst, {} anywhere in the workspace; no singular pose within {:.1} mm of it",
        of_number(conditioning.at_rest, 2),
        of_number(conditioning.worst, 2),
        if conditioning.worst_bound < f64::MAX {
            format!("below {}", of_number(conditioning.worst_bound, 3))
        } else {
            "without a bound".to_owned()
        },
        conditioning.free_of_singularities * 1e3
    );
    let [base, platform] = reach.joint_angles.map(|angle| angle * 1e3);
    let _ = writeln!(text, "  joints turn by up to {base:.3} mrad at the base and {platform:.3} mrad at the platform");
    let half = |half: &[f64]| half.iter().map(|width| format!("{:.1}", width * 1e6)).collect::<Vec<_>>().join("/");
    let (z, declared) = (reach.boxes.centre[2] * 1e6, half(&reach.boxes.as_declared[..3]));
    let (declared_turn, volume) = (half(&reach.boxes.as_declared[3..]), half(&reach.boxes.largest[..3]));
    let (volume_turn, still) = (half(&reach.boxes.largest[3..]), half(&reach.boxes.without_rotation[..3]));
    let _ = writeln!(
        text,
        "  largest box within reach about z = {z:.1} um, all axes together, ± um and urad: {declared} and {declared_turn} with the declared shape; {volume} and {volume_turn} by volume; {still} without rotation"
    );
    text
}
