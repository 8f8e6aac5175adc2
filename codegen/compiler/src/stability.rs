//! Stability of the adaptation, checked at compile time.
//!
//! Two checks over the declared interval of λ = ρ/ρ̂:
//!
//! 1. **Jury**, for a leg that follows its voltage immediately (Appendix B): EWMA 0 < λω < 2, the corrected (AII.18); PCC (AII.19),
//!    whose binding bound is λ < 4/(2ω_Σ − ω_Π).
//! 2. **Spectral radius** of the sampled loop with the leg's own dynamics: amplifier lag, axial resonance and lag of the
//!    gauge, exactly discretised over one run (the drive is held), closed by the filter form of the run-to-run law. This limit is lower
//!    because of the resonance.

mod phase;
pub mod platform;
mod sampled;

use specgen_language::diagnostic::{Code, Diagnostic, codes};
use specgen_language::model::{Adaptation, AdaptationMode, Model};

pub use phase::phase_margin;
pub use sampled::{LegDynamics, shown_at_rest, spectral_radius, transition};
pub use specgen_numerics::{ewma_limit, pcc_limit};

/// Largest accepted radius. The limit is 1. A small weight has a radius just below 1 and is valid, so the margin covers only
/// rounding.
pub const LARGEST_RADIUS: f64 = 1.0 - 1e-6;
/// Number of λ values checked, evenly spaced over the interval, ends included.
const RATIOS: u32 = 9;

/// Margins of a stable spec.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Margins {
    /// Largest λ that the static test allows for these weights; none if the law does not adapt.
    pub static_gain_limit: Option<f64>,
    /// Largest spectral radius of the sampled leg over the λ interval.
    pub spectral_radius: f64,
    /// Largest level weight (drift weight in proportion) that would be stable over the λ interval.
    pub largest_level_weight: Option<f64>,
}

/// A law that a running controller can be switched to with the spec's weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Estimator {
    Ewma,
    Pcc,
}

impl Estimator {
    /// The laws whose weights are given. Each must be stable, because a setting can select any of them.
    fn of(adaptation: &Adaptation) -> Vec<Self> {
        let level = adaptation.level_weight > 0.0;
        let drift = adaptation.drift_weight > 0.0;
        [(Self::Ewma, level), (Self::Pcc, level && drift)]
            .into_iter()
            .filter(|(_, given)| *given)
            .map(|(law, _)| law)
            .collect()
    }

    fn name(self) -> &'static str {
        match self {
            Self::Ewma => "EWMA",
            Self::Pcc => "PCC",
        }
    }

    /// The values of the spec that only this law uses, if `mode` is another law.
    fn unused(self, mode: AdaptationMode) -> Option<&'static str> {
        match (mode, self) {
            (AdaptationMode::Invhys, _) => Some("the weights of level and drift"),
            (AdaptationMode::Ewma, Self::Pcc) => Some("the weight of the drift"),
            _ => None,
        }
    }

    /// λ below which the law is stable on a leg without dynamics, with both weights scaled.
    fn static_limit(self, adaptation: &Adaptation, scale: f64) -> f64 {
        match self {
            Self::Ewma => ewma_limit(scale * adaptation.level_weight),
            Self::Pcc => pcc_limit(scale * adaptation.level_weight, scale * adaptation.drift_weight),
        }
    }
}

/// Checks the weights of `model` for every law that uses them.
///
/// # Errors
/// One finding at the weight's place in the spec, with the largest stable weight.
pub fn check(model: &Model) -> Result<Margins, Vec<Diagnostic>> {
    let adaptation = &model.adaptation;
    let dynamics = LegDynamics::of(model);
    let laws = Estimator::of(adaptation);
    // The largest weight that all laws allow; none if there are no laws.
    let largest = laws.iter().map(|law| largest_level_weight(&dynamics, adaptation, *law)).reduce(f64::min);
    let mut margins = Margins { static_gain_limit: None, spectral_radius: 0.0, largest_level_weight: largest };
    for law in laws {
        let (static_limit, radius) = check_law(model, &dynamics, law, largest.unwrap_or_default())?;
        margins.static_gain_limit = Some(margins.static_gain_limit.map_or(static_limit, |a| a.min(static_limit)));
        margins.spectral_radius = margins.spectral_radius.max(radius);
    }
    Ok(margins)
}

/// Static limit of λ and spectral radius of one law; or its refusal, with `largest` as the largest stable level weight.
fn check_law(
    model: &Model,
    dynamics: &LegDynamics,
    law: Estimator,
    largest: f64,
) -> Result<(f64, f64), Vec<Diagnostic>> {
    let adaptation = &model.adaptation;
    let static_limit = law.static_limit(adaptation, 1.0);
    let highest_ratio = adaptation.gain_ratio[1];
    if highest_ratio >= static_limit {
        let source = match law {
            Estimator::Pcc => "AII.19",
            Estimator::Ewma => "AII.18 corrected to 0 < λω < 2",
        };
        let message = format!(
            "{} is unstable even on a leg without dynamics: with these weights λ = ρ/ρ̂ must stay below {static_limit:.4}, \
             but gain_ratio goes up to {highest_ratio} (Jury, {source})",
            law.name()
        );
        return Err(vec![refusal(model, codes::UNSTABLE_STATIC, law, message, largest)]);
    }
    let radius = worst_radius(dynamics, adaptation, law, 1.0);
    if radius > LARGEST_RADIUS {
        let (name, run, lag, resonance) = (law.name(), dynamics.run, dynamics.lag, model.actuator.resonance);
        let (damping, gauge_lag) = (dynamics.damping_ratio, gauge_lag_text(dynamics.gauge_lag));
        let range = adaptation.gain_ratio;
        let message = format!(
            "{name} is unstable on this leg: the sampled loop (run of {run} s, amplifier lag {lag} s, resonance {resonance} Hz, ζ {damping}{gauge_lag}) has \
             spectral radius {radius:.4} somewhere in gain_ratio {range:?}; it must be below 1"
        );
        return Err(vec![refusal(model, codes::UNSTABLE_SAMPLED, law, message, largest)]);
    }
    Ok((static_limit, radius))
}

/// Addition to a message about a loop if the gauges lag.
fn gauge_lag_text(lag: f64) -> String {
    if lag > 0.0 { format!(", gauges that lag {lag} s") } else { String::new() }
}

/// Largest spectral radius over the λ interval with both weights scaled by `scale`.
fn worst_radius(dynamics: &LegDynamics, adaptation: &Adaptation, law: Estimator, scale: f64) -> f64 {
    let [low, high] = adaptation.gain_ratio;
    (0..RATIOS)
        .map(|k| low + (high - low) * f64::from(k) / f64::from(RATIOS - 1))
        .map(|ratio| {
            let drift = match law {
                Estimator::Pcc => Some(scale * adaptation.drift_weight),
                Estimator::Ewma => None,
            };
            spectral_radius(dynamics, scale * adaptation.level_weight, drift, ratio)
        })
        .fold(0.0, f64::max)
}

/// Largest level weight, drift weight in proportion, below which every weight is stable. It scans upwards and
/// bisects the first crossing: beyond a first unstable range a loop may be stable again, but nobody should rely on it.
fn largest_level_weight(dynamics: &LegDynamics, adaptation: &Adaptation, law: Estimator) -> f64 {
    let largest_scale = match law {
        Estimator::Ewma => 1.0 / adaptation.level_weight,
        Estimator::Pcc => 1.0 / adaptation.level_weight.max(adaptation.drift_weight),
    };
    let stable = |scale: f64| {
        adaptation.gain_ratio[1] < law.static_limit(adaptation, scale)
            && worst_radius(dynamics, adaptation, law, scale) <= LARGEST_RADIUS
    };
    // Four decades up to the largest possible weight.
    let steps = 400;
    let scale_at = |k: i32| largest_scale * libm::exp10(-4.0 * (1.0 - f64::from(k) / f64::from(steps)));
    let Some(first_stable) = (0..=steps).find(|&k| stable(scale_at(k))) else {
        return 0.0;
    };
    let Some(first_unstable) = (first_stable..=steps).find(|&k| !stable(scale_at(k))) else {
        return largest_scale * adaptation.level_weight;
    };
    let (mut low, mut high) = (scale_at(first_unstable - 1), scale_at(first_unstable));
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if stable(middle) { low = middle } else { high = middle }
    }
    low * adaptation.level_weight
}

/// The refusal of a law. The message shows `largest` rounded down, so that the number shown is itself accepted.
fn refusal(model: &Model, code: Code, law: Estimator, mut message: String, largest: f64) -> Diagnostic {
    let bandwidth = model.spans.contains_key("adaptation.level_bandwidth");
    let key = if bandwidth { "adaptation.level_bandwidth" } else { "adaptation.level_weight" };
    let run = model.timing.period * f64::from(model.adaptation.run_interval);
    let shown = |value: f64| {
        let digits = libm::exp10(3.0 - libm::log10(value.abs()).floor());
        (value * digits).floor() / digits
    };
    let help = if largest <= 0.0 {
        "no weight adapts this leg at this run interval: lengthen the run (run_interval, timing.period), or check \
         actuator.resonance, actuator.damping_ratio, amplifier.lag and sensor.lag"
            .to_owned()
    } else {
        let proportion = model.adaptation.drift_weight / model.adaptation.level_weight;
        let level = if bandwidth { shown(largest / run) } else { shown(largest) };
        let (name, unit) = if bandwidth { ("level_bandwidth", " rad/s") } else { ("level_weight", "") };
        let drift = if model.adaptation.drift_weight > 0.0 {
            format!(" (with the drift weight in the same proportion: {:.4e}{unit})", shown(level * proportion))
        } else {
            String::new()
        };
        format!(
            "the largest stable {name} is {level}{unit}{drift}; or lengthen the run, or narrow `adaptation.gain_ratio`, or check `amplifier.lag`, `actuator.resonance` and `timing.period`, which determine the loop"
        )
    };
    let unused = law.unused(model.adaptation.mode);
    if unused.is_some() {
        message += "; the selected mode does not use it, but a running controller can be switched to it";
    }
    let help = unused
        .map_or_else(|| help.clone(), |weights| format!("leave out {weights}, and it cannot be selected; or {help}"));
    Diagnostic::at(&model.spans, &[key], code, message, help)
}
