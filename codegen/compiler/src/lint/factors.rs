//! Optional values compared with their defaults, and factors compared with 1.

use core::ops::RangeInclusive;

use super::{Facts, Findings, figure, times_beyond};
use crate::lower::supervision::{defaults, samples, steadiness};
use specgen_language::diagnostic::{Diagnostic, Severity};

lints! {
    rules: near_defaults, near_one;

    /// # W0888: a value far from its default
    ///
    /// Times, counts and bounds of `[supervisor]`, and `control.dynamics_tolerance`,
    /// should be within a factor of 50 of their defaults. `disagreement` and
    /// `tracking_error`, which are fractions of a range, should not exceed that range.
    /// `disturbance` should be at most 50 times its default, a thirtieth of the stroke.
    ///
    /// ## Why it matters
    ///
    /// A fault detected after ten seconds instead of ten milliseconds is detected too
    /// late. Such a time is usually in the wrong unit.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +
    /// +[supervisor]
    /// +gauge_time = "10 s"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, or leave the key out.
    ///
    /// ```toml
    /// [supervisor]
    /// gauge_time = "10 ms"
    /// ```
    FAR_FROM_DEFAULT = "W0888";

    /// # W0889: a factor far from 1
    ///
    /// Factors of `[robust]` should be between 0.25 and 4, and their range should
    /// include 1.
    ///
    /// ## Why it matters
    ///
    /// They multiply the nominal value: 0.05 is not a tolerance of 5 % but a twentieth
    /// of the mass, and 5 is five times the mass.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +
    /// +[robust]
    /// +mass = [0.05, 0.05]
    /// ```
    ///
    /// ## Fix
    ///
    /// Write the smallest and the largest factor.
    ///
    /// ```toml
    /// [robust]
    /// mass = [0.95, 1.05]
    /// ```
    FACTOR_ODD = "W0889";
}

/// A value over its default: a factor of a thousand is far outside, any reasonable choice well inside.
const NEAR_DEFAULT: RangeInclusive<f64> = 1.0 / 50.0..=50.0;
/// The same for a bound whose default is a fifth of the full range: beyond the full range it has no effect.
const PART_OF_WHOLE: RangeInclusive<f64> = 1.0 / 50.0..=5.0;
/// A factor by which `specgen robust` multiplies a value of the spec.
const SOUND_FACTOR: RangeInclusive<f64> = 0.25..=4.0;

/// A value of the spec and its default.
struct Pair {
    key: String,
    value: Option<f64>,
    default: f64,
    /// Displayed unit, and how many of it are one SI unit.
    unit: (&'static str, f64),
    sound: RangeInclusive<f64>,
}

fn pairs(facts: &Facts) -> Vec<Pair> {
    let (model, spec) = (facts.model, &facts.model.supervisor);
    let of = |name: &str, value, default, unit, sound| Pair {
        key: format!("supervisor.{name}"),
        value,
        default,
        unit,
        sound,
    };
    let time = |name, value, default| of(name, value, default, ("ms", 1e3), NEAR_DEFAULT);
    let step = model.sensor.step();
    let [hold, down] = defaults::HOST_LOST;
    let mut pairs = vec![
        time("arm_time", spec.arm_time, defaults::ARM_TIME),
        time("gauge_time", spec.gauge_time, defaults::GAUGE_TIME),
        time("stuck_time", spec.stuck_time, defaults::STUCK_TIME),
        time("disagreement_time", spec.disagreement_time, defaults::DISAGREEMENT_TIME),
        time("tracking_time", spec.tracking_time, defaults::TRACKING_TIME),
        time("voltage_time", spec.voltage_time, defaults::VOLTAGE_TIME),
        time("slew_time", spec.slew_time, defaults::SLEW_TIME),
        time("host_lost[0]", spec.host_lost.map(|lost| lost[0]), hold),
        time("host_lost[1]", spec.host_lost.map(|lost| lost[1]), down),
        of("ramp_rate", spec.ramp_rate, defaults::ramp_rate(model), ("V/s", 1.0), NEAR_DEFAULT),
        of("stuck_motion", spec.stuck_motion, defaults::stuck_motion(model, step), ("nm", 1e9), NEAR_DEFAULT),
        of("disagreement", spec.disagreement, defaults::disagreement(model), ("um", 1e6), PART_OF_WHOLE),
        of("leap", spec.leap, samples::of_one_leg(model), ("um", 1e6), NEAR_DEFAULT),
        of("disturbance", spec.disturbance, steadiness::usual(model), ("nm", 1e9), NEAR_DEFAULT),
        of("missed_ticks", Some(f64::from(spec.missed_ticks)), 3.0, ("ticks", 1.0), NEAR_DEFAULT),
        of("missed_in_a_row", Some(f64::from(spec.missed_in_a_row)), 100.0, ("ticks", 1.0), NEAR_DEFAULT),
        of("tracking_error", Some(spec.tracking_error), 0.2, ("", 1.0), PART_OF_WHOLE),
    ];
    if let Some(task) = &model.task_space {
        let [low, high] = model.dac.range;
        let code = (high - low) / (libm::exp2(f64::from(model.dac.bits)) - 1.0) * model.actuator.leg_gain();
        pairs.push(Pair {
            key: "control.dynamics_tolerance".to_owned(),
            value: task.dynamics_tolerance,
            default: 0.1 * code,
            unit: ("nm", 1e9),
            sound: NEAR_DEFAULT,
        });
    }
    pairs
}

/// Compares times and bounds of the supervisor with their defaults.
fn near_defaults(facts: &Facts, found: &mut Findings) {
    for Pair { key, value, default, unit: (unit, scale), sound } in pairs(facts) {
        let Some(value) = value.filter(|value| times_beyond(value / default, &sound) > 1.0) else { continue };
        let shown = |value: f64| format!("{} {unit}", figure(value * scale)).trim_end().to_owned();
        found.add(
            FAR_FROM_DEFAULT,
            &key,
            format!("`{key}` is {}, {} times its default of {}", shown(value), figure(value / default), shown(default)),
            "check its unit and digits, or leave the key out",
        );
    }
}

/// Drops `FAR_FROM_DEFAULT` for values that have an error.
pub fn say_once(findings: &mut Vec<Diagnostic>) {
    let list = |key: &str| key.split('[').next().unwrap_or_default().to_owned();
    let errors = findings.iter().filter(|one| one.severity == Severity::Error);
    let refused: Vec<String> = errors.map(|one| list(&one.key)).collect();
    findings.retain(|one| one.code != FAR_FROM_DEFAULT || !refused.contains(&list(&one.key)));
}

/// Checks that the factors of `specgen robust` are around 1, and not percentages or tolerances.
fn near_one(facts: &Facts, found: &mut Findings) {
    let robust = &facts.model.robust;
    let ranges = [
        ("mass", robust.mass),
        ("stiffness", robust.stiffness),
        ("damping", robust.damping),
        ("gain", robust.gain),
        ("hysteresis", robust.hysteresis),
        ("creep", robust.creep),
        ("lag", robust.lag),
        ("gauge_lag", robust.gauge_lag),
        ("noise", robust.noise),
    ];
    for (name, range) in ranges {
        let Some([low, high]) = range else { continue };
        let key = format!("robust.{name}");
        if let Some(end) = [low, high].iter().position(|factor| !SOUND_FACTOR.contains(factor)) {
            found.add(
                FACTOR_ODD,
                &format!("{key}[{end}]"),
                format!("`{key}` would multiply the nominal value by {}", figure([low, high][end])),
                "give the smallest and the largest factor on the nominal value: a tolerance of 5 % is [0.95, 1.05]",
            );
        } else if low > 1.0 || high < 1.0 {
            found.add(
                FACTOR_ODD,
                &key,
                format!("`{key}` is from {} to {}, which does not include the nominal value, 1", figure(low), figure(high)),
                "give a smallest factor of at most 1 and a largest of at least 1; if the nominal value is wrong, correct it instead",
            );
        }
    }
}
