//! Values that come in sixes and should be similar: calibrations of gauges, gains relative to stiffness.

use super::{AXES, Facts, Findings, figure, times_beyond};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Gains, TaskSpace};

lints! {
    rules: calibrations_fit_converter, calibrations, calibrations_straight, gains_by_stiffness, gains_in_order,
        integral_in_time;

    /// # W0827: a calibration unlike the others
    ///
    /// Offset and slope of each gauge are compared with those of the other five.
    ///
    /// ## Why it matters
    ///
    /// Six gauges of one kind have similar calibrations. A factor of three or a
    /// different sign usually means a coefficient in the wrong unit.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-calibration.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -calibration = ["-44.8 um", "9.97 um/V", "12 nm/V^2", "-0.4 nm/V^3"]
    /// +calibration = ["-44.8 um", "99.7 um/V", "12 nm/V^2", "-0.4 nm/V^3"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the coefficients of that gauge, lowest power first.
    ///
    /// ```toml
    /// calibration = ["-44.8 um", "9.97 um/V", "12 nm/V^2", "-0.4 nm/V^3"]
    /// ```
    CALIBRATION_ODD = "W0827";

    /// # W0847: a strongly nonlinear calibration
    ///
    /// Each term above the linear one should contribute less than a tenth of the
    /// range.
    ///
    /// ## Why it matters
    ///
    /// Gauges are linear within 1 or 2 %. A large coefficient is usually in the wrong
    /// unit (um/V^2 for nm/V^2).
    ///
    /// ## Example
    ///
    /// `specs/features/platform-calibration.toml` with
    ///
    /// ```diff
    /// @@ [[gauge]] @@
    /// -calibration = ["-44.8 um", "9.97 um/V", "12 nm/V^2", "-0.4 nm/V^3"]
    /// +calibration = ["-44.8 um", "9.97 um/V", "120 nm/V^2", "-0.4 nm/V^3"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of the coefficients.
    ///
    /// ```toml
    /// calibration = ["-44.8 um", "9.97 um/V", "12 nm/V^2", "-0.4 nm/V^3"]
    /// ```
    CALIBRATION_BENT = "W0847";

    /// # W0828: a gain unlike the others
    ///
    /// The gains over the stiffness of their axes, K = J^T k_a J, should be within a
    /// factor of ten of each other.
    ///
    /// ## Why it matters
    ///
    /// By (8) the bandwidth of an axis is gain / stiffness. An axis ten times slower
    /// or faster than the rest usually has a digit too few or too many.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-gains.toml` with
    ///
    /// ```diff
    /// @@ [position_gains] @@
    /// -proportional = ["5.7e5 N/m", "5.7e5 N/m", "2.2e6 N/m", "1.1e4 N m/rad", "1.1e4 N m/rad", "1.1e4 N m/rad"]
    /// +proportional = ["5e4 N/m", "5.7e5 N/m", "2.2e6 N/m", "1.1e4 N m/rad", "1.1e4 N m/rad", "1.1e4 N m/rad"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the number and its power of ten.
    ///
    /// ```toml
    /// proportional = ["5.7e5 N/m", "5.7e5 N/m", "2.2e6 N/m", "1.1e4 N m/rad", "1.1e4 N m/rad", "1.1e4 N m/rad"]
    /// ```
    GAIN_UNEVEN = "W0828";

    /// # W0845: gains of two axes swapped?
    ///
    /// Gains should be proportional to the stiffness of their axes. Two that differ
    /// from that by a factor of five, and would match if swapped, are reported.
    ///
    /// ## Why it matters
    ///
    /// z of a hexapod is several times stiffer than x and y, and has higher gains.
    /// When swapped, one axis is sluggish and the other near its stability limit.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-gains.toml` with
    ///
    /// ```diff
    /// @@ [gains] @@
    /// -proportional = ["5.07e5 N/m", "5.07e5 N/m", "1.99e6 N/m", "9.9e3 N m/rad", "9.9e3 N m/rad", "9.9e3 N m/rad"]
    /// +proportional = ["1.99e6 N/m", "5.07e5 N/m", "5.07e5 N/m", "9.9e3 N m/rad", "9.9e3 N m/rad", "9.9e3 N m/rad"]
    /// ```
    ///
    /// ## Fix
    ///
    /// The order is x, y, z, θx, θy, θz.
    ///
    /// ```toml
    /// proportional = ["5.07e5 N/m", "5.07e5 N/m", "1.99e6 N/m", "9.9e3 N m/rad", "9.9e3 N m/rad", "9.9e3 N m/rad"]
    /// ```
    GAINS_EXCHANGED = "W0845";

    /// # W0878: an integral action that takes seconds
    ///
    /// `integral` over the stiffness of the axes, K = J^T k_a J, should be at least
    /// 2 1/s.
    ///
    /// ## Why it matters
    ///
    /// Its inverse is about the time in which integral action removes the error that
    /// feed-forward leaves. The error of a hysteresis model changes at every reversal.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-gains.toml` with
    ///
    /// ```diff
    /// @@ [gains] @@
    /// -integral     = ["1.52e9 N/(m s)", "1.52e9 N/(m s)", "5.96e9 N/(m s)", "2.98e7 N m/(rad s)", "2.98e7 N m/(rad s)", "2.97e7 N m/(rad s)"]
    /// +integral     = ["1.52e6 N/(m s)", "1.52e6 N/(m s)", "5.96e6 N/(m s)", "2.98e4 N m/(rad s)", "2.98e4 N m/(rad s)", "2.97e4 N m/(rad s)"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, or leave the gains to the compiler.
    ///
    /// ```toml
    /// integral     = ["1.52e9 N/(m s)", "1.52e9 N/(m s)", "5.96e9 N/(m s)", "2.98e7 N m/(rad s)", "2.98e7 N m/(rad s)", "2.97e7 N m/(rad s)"]
    /// ```
    INTEGRAL_SLOW = "W0878";
}

/// Largest ratio of a calibration coefficient to the median of the six.
const CALIBRATION_SPREAD: f64 = 3.0;
/// Largest contribution of a term above the linear one at an end of the range, in spans. Commercial gauges stay within 0.02.
const MOST_BENT: f64 = 0.1;
/// Least integral gain over the stiffness of its axis, 1/s.
const SLOWEST: f64 = 2.0;
/// Largest ratio of a gain over the stiffness of its axis to the median of the six.
const GAIN_SPREAD: f64 = 10.0;
/// Ratio of two gains over their stiffness: at least this as written, and at most this when swapped.
const EXCHANGED_NOW: f64 = 5.0;
const EXCHANGED_THEN: f64 = 1.5;

/// The median of six magnitudes.
fn middle(values: [f64; 6]) -> f64 {
    let mut sorted = values.map(f64::abs);
    sorted.sort_by(f64::total_cmp);
    0.5 * (sorted[2] + sorted[3])
}

/// Input range of a gauge's converter without `sensor.input_range`, V.
const INPUT: [f64; 2] = [-10.0, 10.0];
/// Reading over the whole input range of the converter, in ranges of the gauge.
const SOUND_SPAN: core::ops::RangeInclusive<f64> = 0.05..=20.0;

/// Checks each slope against the ranges of gauge and converter.
fn calibrations_fit_converter(facts: &Facts, found: &mut Findings) {
    let Some(calibration) = facts.model.task_space.as_ref().and_then(|task| task.calibration.as_ref()) else { return };
    let sensor = &facts.model.sensor;
    let [[low, high], [from, to]] = [sensor.range, sensor.input_range.unwrap_or(INPUT)];
    let mut keys: Vec<String> = Vec::new();
    for (gauge, powers) in calibration.iter().enumerate() {
        let own = format!("gauge[{gauge}].calibration");
        let key = if found.model.spans.contains_key(&own) { own } else { "sensor.calibration".to_owned() };
        let read = libm::fabs(powers[1]) * (to - from);
        let off = times_beyond(read / (high - low), &SOUND_SPAN);
        if off <= 1.0 || keys.contains(&key) {
            continue;
        }
        let [slope, span, volts, range] = [powers[1] * 1e6, read * 1e6, to - from, (high - low) * 1e6].map(figure);
        found.add_off(
            off,
            CALIBRATION_ODD,
            &format!("{key}[1]"),
            format!(
                "at {slope} um/V the gauge reads {span} um over the {volts} V of its converter, but `sensor.range` is {range} um"
            ),
            &format!("check the unit of this coefficient of `{key}`, `sensor.range` and `sensor.input_range`"),
        );
        keys.push(key);
    }
}

/// Checks that the calibrations are similar.
fn calibrations(facts: &Facts, found: &mut Findings) {
    let Some(calibration) = facts.model.task_space.as_ref().and_then(|task| task.calibration.as_ref()) else { return };
    // A slope that does not fit the converter is reported already.
    let is_slope = |one: &Diagnostic| one.key.ends_with("calibration[1]");
    if found.list.iter().any(is_slope) {
        return;
    }
    // Offset and slope; higher powers differ from gauge to gauge.
    for power in 0..2 {
        let values: [f64; 6] = core::array::from_fn(|k| calibration[k].get(power).copied().unwrap_or(0.0));
        let usual = middle(values);
        let positive = values.iter().filter(|value| **value > 0.0).count();
        for (gauge, value) in values.into_iter().enumerate() {
            let far =
                usual > 0.0 && (value.abs() > CALIBRATION_SPREAD * usual || value.abs() < usual / CALIBRATION_SPREAD);
            let turned = (positive == 5 && value < 0.0) || (positive == 1 && value > 0.0);
            if !far && !turned {
                continue;
            }
            found.add(
                CALIBRATION_ODD,
                &format!("gauge[{gauge}].calibration[{power}]"),
                format!(
                    "{} of the calibration of gauge {gauge} is {}, but the median of all six is {}",
                    ["the offset", "the slope"][power],
                    ["um", "um/V"].map(|unit| format!("{} {unit}", figure(value * 1e6)))[power],
                    figure(usual * 1e6)
                ),
                                "compare its unit and sign with the other gauges; if those use `sensor.calibration`, that may be the wrong one; a wrong sign makes the loop unstable",
            );
        }
    }
}

/// Checks that the terms above the linear one are small over the range.
fn calibrations_straight(facts: &Facts, found: &mut Findings) {
    let Some(calibration) = facts.model.task_space.as_ref().and_then(|task| task.calibration.as_ref()) else { return };
    let [low, high] = facts.model.sensor.range;
    for (gauge, powers) in calibration.iter().enumerate() {
        let [offset, slope, ..] = powers[..] else { continue };
        // Volts at the ends of the range, by the slope alone.
        let volts = [low, high].map(|end| libm::fabs((end - offset) / slope));
        let farthest = if volts[0] > volts[1] { volts[0] } else { volts[1] };
        for (power, coefficient) in powers.iter().enumerate().skip(2) {
            let added = libm::fabs(coefficient * libm::pow(farthest, power as f64));
            if added.is_nan() || added <= MOST_BENT * (high - low) {
                continue;
            }
            let own = format!("gauge[{gauge}].calibration");
            let key = if found.model.spans.contains_key(&own) { own } else { "sensor.calibration".to_owned() };
            let [adds, at, range] = [added * 1e6, farthest, (high - low) * 1e6].map(figure);
            found.add(
                CALIBRATION_BENT,
                &format!("{key}[{power}]"),
                format!(
                    "power {power} of the calibration of gauge {gauge} adds {adds} um at {at} V, on a range of {range} um"
                ),
                                "gauges are linear within 1 or 2 % of their range: check the unit of this coefficient (nm/V^2 or um/V^2) and of the slope before it",
            );
        }
    }
}

/// The gains in the spec, by key.
fn gains_of(task: &TaskSpace) -> Vec<(String, [f64; 6])> {
    let sections = [("gains", &task.gains), ("position_gains", &task.position_gains)];
    let given = sections.into_iter().filter_map(|(section, gains)| Some((section, gains.as_ref()?)));
    let keys = |(section, gains): (&str, &Gains)| {
        [("proportional", gains.proportional), ("integral", gains.integral), ("derivative", gains.derivative)]
            .map(|(name, values)| (format!("{section}.{name}"), values))
    };
    given.flat_map(keys).collect()
}

/// Checks that gains are proportional to the stiffness of their axes.
fn gains_by_stiffness(facts: &Facts, found: &mut Findings) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    for (key, values) in gains_of(task) {
        let ratios: [f64; 6] = core::array::from_fn(|axis| values[axis] / stiffness[axis]);
        let usual = middle(ratios);
        for (axis, ratio) in ratios.into_iter().enumerate() {
            // A gain of zero disables the axis.
            if ratio == 0.0 || usual == 0.0 || (1.0 / GAIN_SPREAD..=GAIN_SPREAD).contains(&(ratio / usual)) {
                continue;
            }
            let (name, gain, times) = (AXES[axis], figure(values[axis]), figure(ratio / usual));
            let of_axis = figure(stiffness[axis]);
            found.add_off(
                times_beyond(ratio / usual, &(1.0 / GAIN_SPREAD..=GAIN_SPREAD)),
                GAIN_UNEVEN,
                &format!("{key}[{axis}]"),
                format!(
                    "the gain of {name} is {gain}: relative to the stiffness of its axis, that is {times} times the gains of the other axes (stiffness {of_axis})"
                ),
                &format!("about {:.3e} would match the others: check the unit", usual * stiffness[axis]),
            );
        }
    }
}

/// Checks that integral action is faster than seconds.
fn integral_in_time(facts: &Facts, found: &mut Findings) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    for (key, values) in gains_of(task).into_iter().filter(|(key, _)| key.ends_with("integral")) {
        let rate = middle(core::array::from_fn(|axis| values[axis] / stiffness[axis]));
        if rate == 0.0 || rate >= SLOWEST {
            continue;
        }
        let [per_second, seconds] = [rate, 1.0 / rate].map(figure);
        found.add(
            INTEGRAL_SLOW,
            &key,
            format!(
                "the integral gains over the stiffness of their axes are about {per_second} 1/s: a time constant of {seconds} s"
            ),
            "tens to hundreds of 1/s are usual: check the unit (N/(m s), N m/(rad s)), or leave the gains out: the compiler derives them",
        );
    }
}

/// Checks for swapped gains: neither fits the stiffness of its axis, and both do when swapped.
fn gains_in_order(facts: &Facts, found: &mut Findings) {
    let (Some(task), Some(legs)) = (&facts.model.task_space, &facts.legs) else { return };
    let stiffness = legs.stiffness(facts.model.actuator.axial_stiffness);
    for (key, values) in gains_of(task) {
        // Within translations and within rotations: across them the units differ.
        for (a, b) in [(0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5)] {
            if values[a] == 0.0 || values[b] == 0.0 {
                continue;
            }
            let apart = |one: f64, other: f64| libm::fabs(libm::log((one / stiffness[a]) / (other / stiffness[b])));
            let (now, exchanged) = (apart(values[a], values[b]), apart(values[b], values[a]));
            if now <= libm::log(EXCHANGED_NOW) || exchanged >= libm::log(EXCHANGED_THEN) {
                continue;
            }
            let (first, second, gain, other) = (AXES[a], AXES[b], figure(values[a]), figure(values[b]));
            let times = figure(stiffness[a] / stiffness[b]);
            found.add(
                GAINS_EXCHANGED,
                &format!("{key}[{a}]"),
                format!(
                    "the gains of {first} and {second} are {gain} and {other}, but the platform is {times} times as stiff along the first as along the second"
                ),
                &format!("if they were swapped they would match the stiffness: check the order of `{key}`"),
            );
        }
    }
}
