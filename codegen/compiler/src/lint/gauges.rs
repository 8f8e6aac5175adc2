//! Gauges: resolution, range, layout.

use super::{FAR_OFF, Facts, Findings, amount, figure};

lints! {
    rules: differ, noise_of_a_step, range_centred, range_beyond_zero, step_against_stroke, odd_coordinates,
        opposite_directions, noise_of_many_steps;

    /// # E0328: two identical gauges
    ///
    /// No two gauges may have the same `point` and the same `direction`.
    ///
    /// ## Why it matters
    ///
    /// There are then only five independent readings, and one motion of the platform
    /// is not measured. Usually a section was copied and not changed.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// -point     = ["-80 mm", "0 mm", "180 mm"]
    /// +point     = ["80 mm", "0 mm", "180 mm"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Give the second gauge its own point or direction.
    ///
    /// ```toml
    /// point     = ["-80 mm", "0 mm", "180 mm"]
    /// ```
    GAUGES_ALIKE = "E0328";

    /// # W0820: gauge noise far below its step
    ///
    /// `sensor.noise` should be at least 0.06 of a step of `sensor.bits` over
    /// `sensor.range`.
    ///
    /// ## Why it matters
    ///
    /// Noise far below the resolution of the converter cannot be measured. The unit is
    /// wrong, or the value is a data-sheet resolution at 1 Hz bandwidth.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [sensor] @@
    /// -noise = "2.2 nm"
    /// +noise = "2.2 pm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Write the noise at the tick rate, or 0 for none.
    ///
    /// ```toml
    /// noise = "2.2 nm"
    /// ```
    GAUGE_QUIET = "W0820";

    /// # W0821: ends of the range in different units?
    ///
    /// Neither end of `sensor.range` should be a hundred times further from rest than
    /// the other. Nor should it be both five times further and five times beyond the
    /// motion of the platform. The range of a leg's gauge should end within five
    /// strokes.
    ///
    /// ## Why it matters
    ///
    /// The whole range determines the step of the converter, and so the noise of the
    /// loop.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [sensor] @@
    /// -range = ["-55 um", "55 um"]
    /// +range = ["-55 um", "0.55 mm"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit of each end.
    ///
    /// ```toml
    /// range = ["-55 um", "55 um"]
    /// ```
    GAUGE_LOPSIDED = "W0821";

    /// # W0846: an end of the range that is nearly zero
    ///
    /// An end of `sensor.range`, if it is not zero, should be at least a thousandth
    /// of the range from rest.
    ///
    /// ## Why it matters
    ///
    /// It is usually nm written for um. Creep and drift alone would move the reading
    /// out of the range.
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [sensor] @@
    /// -range = ["-2 um", "48 um"]
    /// +range = ["-2 nm", "48 um"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, or write 0.
    ///
    /// ```toml
    /// range = ["-2 um", "48 um"]
    /// ```
    RANGE_AT_ZERO = "W0846";

    /// # W0823: a coordinate that is nearly zero
    ///
    /// A coordinate of a gauge, if it is not zero, should not be tiny compared with the
    /// size of the platform.
    ///
    /// ## Why it matters
    ///
    /// It is usually um written for mm. The lever arm of the gauge about that axis
    /// would vanish.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -point     = ["80 mm", "0 mm", "180 mm"]
    /// +point     = ["80 um", "0 mm", "180 mm"]
    ///  direction = [0, 0, 1]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, or write 0.
    ///
    /// ```toml
    /// point     = ["80 mm", "0 mm", "180 mm"]
    /// ```
    COORDINATE_ODD = "W0823";

    /// # W0824: gauges of opposite sign
    ///
    /// Parallel gauges should have the same direction.
    ///
    /// ## Why it matters
    ///
    /// A wrong sign makes the feedback positive, and the loop is unstable. Check it by
    /// moving the platform by hand before the amplifiers are switched on.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    ///  point     = ["-40 mm", "69.282 mm", "180 mm"]
    /// -direction = [0, 0, 1]
    /// +direction = [0, 0, -1]
    /// ```
    ///
    /// ## Fix
    ///
    /// Reverse the direction, unless the gauge really counts that way.
    ///
    /// ```toml
    /// direction = [0, 0, 1]
    /// ```
    GAUGE_REVERSED = "W0824";

    /// # W0886: gauge noise of many steps
    ///
    /// `sensor.noise` should be less than 40 steps of a converter of 18 bits or fewer.
    /// Noise beyond that of any gauge is reported as W0303.
    ///
    /// ## Why it matters
    ///
    /// A converter is matched to its gauge. If its last five bits were only noise, the
    /// converter would be wasted. Usually the noise is in the wrong unit, or peak to
    /// peak.
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [sensor] @@
    /// -noise = "2.2 nm"
    /// +noise = "35 nm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, and that the value is rms.
    ///
    /// ```toml
    /// noise = "2.2 nm"
    /// ```
    GAUGE_NOISY = "W0886";

    /// # W0822: gauge step too coarse
    ///
    /// One code of a gauge should be less than a thousandth of the stroke. It should
    /// also be finer than the noise if the range is more than five times the motion to
    /// measure.
    ///
    /// ## Why it matters
    ///
    /// Feedback cannot do better than one step; the platform hunts within it.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [sensor] @@
    /// -bits  = 17
    /// +bits  = 10
    /// ```
    ///
    /// ## Fix
    ///
    /// Check bits and range.
    ///
    /// ```toml
    /// bits  = 17
    /// ```
    GAUGE_COARSE = "W0822";
}

/// Noise below this share of a converter step cannot be measured.
const QUIETEST: f64 = 0.06;
/// Largest range of a gauge over the motion to measure.
const WIDEST: f64 = 5.0;
/// Largest noise of a gauge, in steps of a converter with at most [`FINE_BITS`].
const NOISIEST: f64 = 40.0;
/// Largest noise over the motion to measure, and the narrowest range over the stroke: as in the checks of the spec.
const BEYOND_ALL: f64 = 2e-3;
const NARROWEST: f64 = 0.05;
const FINE_BITS: u32 = 18;
/// Coarsest step, as a share of the stroke.
const COARSEST_STEP: f64 = 1e-3;
/// Largest range to one side, in motions to that side. Gauges are sold in steps of 2 to 2.5, so this is two steps too wide.
const FARTHEST: f64 = 5.0;
/// Largest ratio of the two sides of a range about rest: if one side is also beyond [`FARTHEST`], and in any case.
const UNEVEN: f64 = 5.0;
const LOPSIDED: f64 = 100.0;
/// Least distance of an end of the range from zero, as a share of the whole range, unless it is exactly zero.
const END_AT_ZERO: f64 = 1e-3;
/// Coordinates between the two are suspicious: below this share of the platform, but above the rounding of a drawing, m.
const NEARLY_ZERO: f64 = 2e-3;
const ROUNDING: f64 = 1e-6;
/// Least cosine between parallel lines.
const PARALLEL: f64 = 0.99;

/// Checks that the noise is not far below the converter's step.
fn noise_of_a_step(facts: &Facts, found: &mut Findings) {
    let (noise, step) = (facts.model.sensor.noise, facts.model.sensor.step());
    if noise == 0.0 || noise >= QUIETEST * step {
        return;
    }
    let [rms, share, code] = [noise * 1e9, noise / step, step * 1e9].map(figure);
    found.add(
        GAUGE_QUIET,
        "sensor.noise",
        format!(
            "a noise of {rms} nm rms is only {share} of the converter's step of {code} nm"
        ),
        "noise this far below the step cannot be measured: check `sensor.bits`, `sensor.range` and the unit of `sensor.noise` (nm or pm), or leave the noise out",
    );
}

/// Checks that the noise does not fill the lower bits of the converter.
fn noise_of_many_steps(facts: &Facts, found: &mut Findings) {
    let (noise, step, stroke) = (facts.model.sensor.noise, facts.model.sensor.step(), facts.model.actuator.stroke);
    let [low, high] = facts.model.sensor.range;
    let seen = if stroke < high - low { stroke } else { high - low };
    // Noise beyond any gauge has a finding of its own (W0303). Far beyond, it is an error, unless the range is the odd one (W0304).
    let beyond = noise / (BEYOND_ALL * seen);
    let is_known = beyond > 1.0 && (beyond < FAR_OFF || high - low < NARROWEST * stroke);
    if facts.model.sensor.bits > FINE_BITS || noise <= NOISIEST * step || is_known {
        return;
    }
    let (rms, steps, bits) = (figure(noise * 1e9), figure(noise / step), facts.model.sensor.bits);
    let code = figure(step * 1e9);
    found.add_off(
        beyond,
        GAUGE_NOISY,
        "sensor.noise",
        format!("a noise of {rms} nm rms is {steps} steps of the gauge's converter of {bits} bits, {code} nm each"),
        "a converter is matched to its gauge: check the unit of `sensor.noise` (nm or um; rms) and of `sensor.range`",
    );
}

/// Checks that both ends of the range have the same unit.
fn range_centred(facts: &Facts, found: &mut Findings) {
    let [low, high] = facts.model.sensor.range;
    let stroke = facts.model.actuator.stroke;
    let below = -low;
    let (asymmetric, item) = if facts.model.task_space.is_some() {
        // From rest, a platform moves both ways.
        let seen = FARTHEST * farthest_seen(facts);
        let beyond = |far: f64, near: f64| far > LOPSIDED * near || (far > UNEVEN * near && far > seen);
        (below > 0.0 && high > 0.0 && (beyond(below, high) || beyond(high, below)), usize::from(high < below))
    } else {
        (below > FARTHEST * stroke || high > FARTHEST * stroke, usize::from(high > below))
    };
    if !asymmetric {
        return;
    }
    let [from, to, stroke] = [low * 1e6, high * 1e6, stroke * 1e6].map(figure);
    found.add(
        GAUGE_LOPSIDED,
        &format!("sensor.range[{item}]"),
        format!("the gauge measures from {from} um to {to} um, but the stroke is {stroke} um"),
        "check the unit and digits of both ends of `sensor.range`",
    );
}

/// Checks for an end of a range that is tiny compared with the other.
fn range_beyond_zero(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    for (name, range, scale, unit) in
        [("sensor.range", model.sensor.range, 1e6, "um"), ("dac.range", model.dac.range, 1.0, "V")]
    {
        for (item, end) in range.into_iter().enumerate() {
            if end == 0.0 || libm::fabs(end) >= END_AT_ZERO * (range[1] - range[0]) {
                continue;
            }
            let [from, to] = [range[0] * scale, range[1] * scale].map(figure);
            found.add(
                RANGE_AT_ZERO,
                &format!("{name}[{item}]"),
                format!("a range from {from} {unit} to {to} {unit} has an end that is almost 0"),
                &format!("check the unit of this end of `{name}`; write 0 if that is intended"),
            );
        }
    }
}

/// Largest displacement at any gauge in the workspace, m, to first order: every axis at its bound.
fn farthest_seen(facts: &Facts) -> f64 {
    let Some(task) = &facts.model.task_space else { return 0.0 };
    let (along, turns) = (facts.model.workspace.translation, facts.model.workspace.rotation);
    task.probes.iter().fold(0.0, |most: f64, probe| {
        let [x, y, z] = [probe.point[0], probe.point[1], probe.point[2] - facts.model.geometry.height];
        let n = probe.direction;
        let lever = [y * n[2] - z * n[1], z * n[0] - x * n[2], x * n[1] - y * n[0]];
        let seen = (0..3).fold(0.0, |sum, k| sum + libm::fabs(n[k]) * along[k] + libm::fabs(lever[k]) * turns[k]);
        if seen > most { seen } else { most }
    })
}

/// Checks for a range far beyond the motion, if that makes the step coarser than the noise.
fn range_too_wide(facts: &Facts, found: &mut Findings) {
    let (model, step) = (facts.model, facts.model.sensor.step());
    let [low, high] = model.sensor.range;
    let seen = if model.task_space.is_some() { 2.0 * farthest_seen(facts) } else { model.actuator.stroke };
    let noise = model.sensor.noise;
    if high - low <= WIDEST * seen || noise >= step {
        return;
    }
    let beside = if noise > 0.0 { format!(", {} times its noise", figure(step / noise)) } else { String::new() };
    let [span, times, code] = [(high - low) * 1e6, (high - low) / seen, step * 1e9].map(figure);
    found.add(
        GAUGE_COARSE,
        "sensor.range",
        format!("the gauge spans {span} um, {times} times the motion to measure; one code is {code} nm{beside}"),
        "check the unit and digits of `sensor.range`; a wide range needs more `sensor.bits`",
    );
}

/// Checks one code of the gauge against the motion and the stroke.
fn step_against_stroke(facts: &Facts, found: &mut Findings) {
    range_too_wide(facts, found);
    let (step, stroke) = (facts.model.sensor.step(), facts.model.actuator.stroke);
    if step <= COARSEST_STEP * stroke {
        return;
    }
    let [code, share, travel] = [step * 1e9, step / stroke, stroke * 1e6].map(figure);
    found.add_off(
        step / (COARSEST_STEP * stroke),
        GAUGE_COARSE,
        "sensor.bits",
        format!("one code of the gauge is {code} nm, {share} of the stroke of {travel} um"),
        "16 bits or more are usual; check `sensor.range` and `sensor.bits`",
    );
}

/// Checks for identical gauges: usually a section that was copied and not changed.
fn differ(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let seen = |gauge: usize| {
        let probe = &task.probes[gauge];
        (probe.point, probe.direction, probe.plane_point, probe.plane_normal)
    };
    for later in 1..6 {
        let Some(earlier) = (0..later).find(|earlier| seen(*earlier) == seen(later)) else { continue };
        found.add(
            GAUGES_ALIKE,
            &format!("gauge[{later}].point"),
            format!(
                "gauge {later} has the same point and direction as gauge {earlier}; six independent readings are needed"
            ),
            &format!("change `point` or `direction` of `gauge[{later}]`, which may be a copy of `gauge[{earlier}]`"),
        );
    }
}

/// Checks for coordinates that are tiny compared with the platform.
fn odd_coordinates(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let radius = facts.model.geometry.joint_radius();
    for (gauge, probe) in task.probes.iter().enumerate() {
        let target = format!("gauge[{gauge}].target_point");
        let given = found.model.spans.contains_key(&target);
        let points = [(format!("gauge[{gauge}].point"), probe.point), (target, probe.plane_point)];
        let listed = points.iter().take(1 + usize::from(given));
        for (key, axis, value) in listed.flat_map(|(key, point)| (0..3).map(move |axis| (key, axis, point[axis]))) {
            if value.abs() < ROUNDING || value.abs() >= NEARLY_ZERO * radius {
                continue;
            }
            let (name, value, radius) = (["x", "y", "z"][axis], amount(0, value), figure(radius * 1e3));
            found.add(
                COORDINATE_ODD,
                &format!("{key}[{axis}]"),
                format!("{name} of `{key}` is {value}, but the platform has a radius of {radius} mm"),
                "check the unit (mm or um); write \"0 mm\" if the centre is intended",
            );
        }
    }
}

/// Checks for a gauge that counts opposite to parallel ones.
fn opposite_directions(facts: &Facts, found: &mut Findings) {
    let Some(task) = &facts.model.task_space else { return };
    let along = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for (gauge, probe) in task.probes.iter().enumerate() {
        let others = task.probes.iter().enumerate().filter(|(other, _)| *other != gauge);
        let (mut with, mut against) = (0_usize, None);
        for (other, one) in others {
            let cosine = along(&probe.direction, &one.direction);
            with += usize::from(cosine > PARALLEL);
            if cosine < -PARALLEL {
                against = Some((other, against.map_or(1, |(_, count)| count + 1)));
            }
        }
        let Some((other, count)) = against else { continue };
        // Of two, the later one is reported; of more, the one that differs.
        if count < with + 1 || (count == with + 1 && gauge < other) {
            continue;
        }
        found.add(
            GAUGE_REVERSED,
            &format!("gauge[{gauge}].direction"),
            format!("gauge {gauge} counts opposite to gauge {other}, which is parallel to it"),
            &format!(
                                "a wrong sign makes the loop unstable: with the amplifiers off, move the platform by hand; if the readings change as `gauge[{other}].direction` and `gauge[{gauge}].direction` say, both are correct"
            ),
        );
    }
}
