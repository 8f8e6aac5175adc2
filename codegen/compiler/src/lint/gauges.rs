//! Gauges: resolution, range, layout.

use super::{FAR_OFF, Facts, Found, amount, figure};

lints! {
    rules: differ, noise_of_a_step, range_centred, range_beyond_zero, step_against_stroke, odd_coordinates,
        opposite_directions, noise_of_many_steps;

    /// # E0328: two gauges that are one
    ///
    /// No two of the gauges may have the same `point` and the same `direction`.
    ///
    /// ## Why it matters
    ///
    /// Six readings are then five, and a motion of the platform is unseen. Most often
    /// a section was copied and not changed.
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
    /// Give the second gauge its own place, or its own direction.
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
    /// A noise below what the converter shows cannot be measured; it is a slip of the
    /// unit, or the resolution of a data sheet at 1 Hz bandwidth.
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

    /// # W0821: a range with ends in different units?
    ///
    /// Neither end of `sensor.range` should lie a hundred times further from rest
    /// than the other, nor five times further and five times beyond what there is to
    /// see; a leg's gauge should not end five strokes away.
    ///
    /// ## Why it matters
    ///
    /// The step of the converter, and with it the noise of the loop, is counted from
    /// the whole range.
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
    /// It is a slip of nm for um: creep and drift alone would take the reading out of
    /// the range.
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
    /// A coordinate of a gauge, if it is not zero, should not be next to nothing
    /// beside the size of the platform.
    ///
    /// ## Why it matters
    ///
    /// It is a slip of mm for um or for m. The lever of the gauge about that axis
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

    /// # W0824: gauges that count against each other
    ///
    /// Gauges along the same line should count in the same sense.
    ///
    /// ## Why it matters
    ///
    /// A wrong sign turns feedback into positive feedback: the loop runs away at
    /// once. Check it by moving the platform by hand before the amplifiers are on.
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
    /// Turn the direction round, if the gauge really counts that way.
    ///
    /// ```toml
    /// direction = [0, 0, 1]
    /// ```
    GAUGE_REVERSED = "W0824";

    /// # W0886: gauge noise of many steps
    ///
    /// `sensor.noise` should be less than 40 steps of a converter of 18 bits or fewer.
    /// A noise beyond that of all gauges is W0303.
    ///
    /// ## Why it matters
    ///
    /// A converter is chosen for its gauge. One that shows nothing but noise in its
    /// last five bits belongs to a better gauge: the noise is in another unit, or peak
    /// to peak.
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
    /// Check the unit; rms is meant.
    ///
    /// ```toml
    /// noise = "2.2 nm"
    /// ```
    GAUGE_NOISY = "W0886";

    /// # W0822: gauge step large against the stroke
    ///
    /// One code of a gauge should be less than a thousandth of the stroke, and finer
    /// than the noise where the range is more than five times what there is to see.
    ///
    /// ## Why it matters
    ///
    /// Feedback cannot do better than the step; it goes to and fro within it.
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

/// Noise below this share of a converter step cannot be known.
const QUIETEST: f64 = 0.06;
/// Range of a gauge over what there is to see.
const WIDEST: f64 = 5.0;
/// Steps of noise beside which a converter is too fine to be meant, and bits from which on converters are so for any gauge.
const NOISIEST: f64 = 40.0;
/// Noise of what there is to see that no gauge has, and the narrowest range of the stroke, as the checks of the spec have them.
const BEYOND_ALL: f64 = 2e-3;
const NARROWEST: f64 = 0.05;
const FINE_BITS: u32 = 18;
/// A step coarser than this share of the stroke.
const COARSEST_STEP: f64 = 1e-3;
/// How far a gauge may reach to one side, in what there is to see there. Gauges come in steps of 2 to 2.5: that is two steps
/// too wide.
const FARTHEST: f64 = 5.0;
/// The two sides of a range that is declared about rest, where one reaches too far; and wherever it reaches.
const UNEVEN: f64 = 5.0;
const LOPSIDED: f64 = 100.0;
/// An end of the range that is not zero but below this share of the whole: nobody sets the zero of a gauge so near.
const END_AT_ZERO: f64 = 1e-3;
/// A coordinate that is not zero but below this share of the platform, and above the rounding of a drawing.
const NEARLY_ZERO: f64 = 2e-3;
const ROUNDING: f64 = 1e-6;
/// Lines within this angle of each other are parallel, as a cosine.
const PARALLEL: f64 = 0.99;

/// A noise far below the converter's step is a slip of the unit.
fn noise_of_a_step(facts: &Facts, found: &mut Found) {
    let (noise, step) = (facts.model.sensor.noise, facts.model.sensor.step());
    if noise == 0.0 || noise >= QUIETEST * step {
        return;
    }
    found.add(
        GAUGE_QUIET,
        "sensor.noise",
        format!(
            "a noise of {} nm rms is {} of the converter's step of {} nm",
            figure(noise * 1e9),
            figure(noise / step),
            figure(step * 1e9)
        ),
        "a noise so far below the step cannot be measured: check `sensor.bits`, `sensor.range` and the unit of `sensor.noise` (nm or pm), or leave the noise out",
    );
}

/// A converter of few bits that shows nothing but noise is a slip of the noise's unit, or of the range.
fn noise_of_many_steps(facts: &Facts, found: &mut Found) {
    let (noise, step, stroke) = (facts.model.sensor.noise, facts.model.sensor.step(), facts.model.actuator.stroke);
    let [low, high] = facts.model.sensor.range;
    let seen = if stroke < high - low { stroke } else { high - low };
    // What is beyond all gauges is said with the spec (W0303). What is far beyond them is refused, unless it is the range that is
    // odd (W0304).
    let beyond = noise / (BEYOND_ALL * seen);
    let is_said = beyond > 1.0 && (beyond < FAR_OFF || high - low < NARROWEST * stroke);
    if facts.model.sensor.bits > FINE_BITS || noise <= NOISIEST * step || is_said {
        return;
    }
    found.add_off(
        beyond,
        GAUGE_NOISY,
        "sensor.noise",
        format!(
            "a noise of {} nm rms is {} steps of the gauge's converter of {} bits, {} nm each",
            figure(noise * 1e9),
            figure(noise / step),
            facts.model.sensor.bits,
            figure(step * 1e9)
        ),
        "a converter is chosen for its gauge: check the unit of `sensor.noise` (nm or um; rms) and of `sensor.range`",
    );
}

/// Both ends of the range in the same unit.
fn range_centred(facts: &Facts, found: &mut Found) {
    let [low, high] = facts.model.sensor.range;
    let stroke = facts.model.actuator.stroke;
    let below = -low;
    let (asymmetric, item) = if facts.model.task_space.is_some() {
        // Seen from rest, a platform moves both ways.
        let seen = FARTHEST * farthest_seen(facts);
        let beyond = |far: f64, near: f64| far > LOPSIDED * near || (far > UNEVEN * near && far > seen);
        (below > 0.0 && high > 0.0 && (beyond(below, high) || beyond(high, below)), usize::from(high < below))
    } else {
        (below > FARTHEST * stroke || high > FARTHEST * stroke, usize::from(high > below))
    };
    if !asymmetric {
        return;
    }
    found.add(
        GAUGE_LOPSIDED,
        &format!("sensor.range[{item}]"),
        format!(
            "the gauge reaches from {} um to {} um, the stroke is {} um",
            figure(low * 1e6),
            figure(high * 1e6),
            figure(stroke * 1e6)
        ),
        "check both ends of `sensor.range`, their unit and their digits",
    );
}

/// An end of a range in the wrong unit is a tiny one beside the other.
fn range_beyond_zero(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    for (name, range, scale, unit) in
        [("sensor.range", model.sensor.range, 1e6, "um"), ("dac.range", model.dac.range, 1.0, "V")]
    {
        for (item, end) in range.into_iter().enumerate() {
            if end == 0.0 || libm::fabs(end) >= END_AT_ZERO * (range[1] - range[0]) {
                continue;
            }
            found.add(
                RANGE_AT_ZERO,
                &format!("{name}[{item}]"),
                format!(
                    "a range from {} {unit} to {} {unit} ends next to 0, but not there",
                    figure(range[0] * scale),
                    figure(range[1] * scale)
                ),
                &format!("check the unit of this end of `{name}`; write 0 if it is meant to be there"),
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

/// A range of many times what there is to see wastes the converter, where its step is coarser than the gauge's noise.
fn range_too_wide(facts: &Facts, found: &mut Found) {
    let (model, step) = (facts.model, facts.model.sensor.step());
    let [low, high] = model.sensor.range;
    let seen = if model.task_space.is_some() { 2.0 * farthest_seen(facts) } else { model.actuator.stroke };
    let noise = model.sensor.noise;
    if high - low <= WIDEST * seen || noise >= step {
        return;
    }
    let beside = if noise > 0.0 { format!(", {} times its noise", figure(step / noise)) } else { String::new() };
    found.add(
        GAUGE_COARSE,
        "sensor.range",
        format!(
            "the gauge spans {} um, {} times what there is to see; one code of it is {} nm{beside}",
            figure((high - low) * 1e6),
            figure((high - low) / seen),
            figure(step * 1e9)
        ),
        "check the unit and the digits of `sensor.range`; a wide range asks for more `sensor.bits`",
    );
}

/// One code of the gauge against the stroke.
fn step_against_stroke(facts: &Facts, found: &mut Found) {
    range_too_wide(facts, found);
    let (step, stroke) = (facts.model.sensor.step(), facts.model.actuator.stroke);
    if step <= COARSEST_STEP * stroke {
        return;
    }
    found.add_off(
        step / (COARSEST_STEP * stroke),
        GAUGE_COARSE,
        "sensor.bits",
        format!(
            "one code of the gauge is {} nm, {} of the stroke of {} um",
            figure(step * 1e9),
            figure(step / stroke),
            figure(stroke * 1e6)
        ),
        "a converter of 16 bits or more is usual; check `sensor.range` and `sensor.bits`",
    );
}

/// Two gauges that see the same are one, whatever they are called: most often a section that was copied and not changed.
fn differ(facts: &Facts, found: &mut Found) {
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
                "gauge {later} stands and looks as gauge {earlier}: six readings are needed, and these two are one"
            ),
            &format!("change `point` or `direction` of `gauge[{later}]`, if it was copied from `gauge[{earlier}]`"),
        );
    }
}

/// A coordinate in the wrong unit is a tiny one beside large ones.
fn odd_coordinates(facts: &Facts, found: &mut Found) {
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
            found.add(
                COORDINATE_ODD,
                &format!("{key}[{axis}]"),
                format!(
                    "{} of `{key}` is {}, on a platform of {} mm",
                    ["x", "y", "z"][axis],
                    amount(0, value),
                    figure(radius * 1e3)
                ),
                "check the unit (mm or um); write \"0 mm\" if it is meant to be in the middle",
            );
        }
    }
}

/// Parallel gauges that count the same way are the rule; one that counts the other way has a wrong sign, or means to.
fn opposite_directions(facts: &Facts, found: &mut Found) {
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
        // Of two, the later one is named; of more, the one that stands alone.
        if count < with + 1 || (count == with + 1 && gauge < other) {
            continue;
        }
        found.add(
            GAUGE_REVERSED,
            &format!("gauge[{gauge}].direction"),
            format!("gauge {gauge} counts against gauge {other}, which looks along the same line the other way"),
            &format!(
                "a wrong sign makes the loop run away: with the amplifiers off, move the platform by hand and see that the readings go as `gauge[{other}].direction` and `gauge[{gauge}].direction` say; if so, nothing is wrong"
            ),
        );
    }
}
