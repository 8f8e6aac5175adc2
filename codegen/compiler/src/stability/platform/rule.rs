//! Tuning rule for gains and bandwidths that the spec leaves out.
//!
//! From Ω, the bandwidth at which the level estimate alone becomes unstable: Ω1 = Ω/4.5, Ω2 = 0.044 Ω1, k_I = Ω/12 · K,
//! k_p = 0.05 K (without notch 0.005), without estimates k_I = Ω/2 · K, with K = diag(Jᵀ k_a J). Then all of them are multiplied by 0.85 until
//! the loop is stable with λ = 2, with stiffness ± 15 % at λ = 1.4, and with one more tick of delay at λ = 1.3, each with 0.7 of the
//! damping, free and touching the declared work piece, and with every structural mode that the spec demands.

use super::closed_loop::{ClosedLoop, Conditions};
use super::damping::{self, DampedLaw};
use super::law::{LoopKind, Tuning};
use super::notch::Notch;
use super::search::largest_stable;
use super::structure::{Corners, StructureDemand};
use super::{LARGEST_RADIUS, nominal_conditions};
use specgen_runtime::{ControlMode, Law};

/// Ω over the level bandwidth.
const LEVEL: f64 = 4.5;
/// Drift over level bandwidth.
const DRIFT: f64 = 0.044;
/// Ω over k_I/K, with estimates and without.
const INTEGRAL: f64 = 12.0;
const INTEGRAL_ALONE: f64 = 2.0;
/// k_p/K with and without notch.
const PROPORTIONAL: f64 = 0.05;
const PROPORTIONAL_PLAIN: f64 = 0.005;
/// Factor of one step, and the number of steps: 0.85⁴⁰ is 0.0015.
const SHRINK: f64 = 0.85;
const SHRINKS: u32 = 40;

/// Conditions under which the rule's values must be stable.
const ROBUST: [Conditions; 4] = [
    Conditions { gain_ratio: 2.0, damping: 0.7, ..Conditions::NOMINAL },
    Conditions { gain_ratio: 1.4, damping: 0.7, stiffness: 0.85, ..Conditions::NOMINAL },
    Conditions { gain_ratio: 1.4, damping: 0.7, stiffness: 1.15, ..Conditions::NOMINAL },
    Conditions { gain_ratio: 1.3, damping: 0.7, delay: 1.0, ..Conditions::NOMINAL },
];

/// Ω, rad/s: lowest level bandwidth at which EWMA alone is unstable on the nominal platform; 1/T_s, a weight of 1, if none
/// is unstable; zero if even a ten-thousandth of that is.
pub fn bandwidth_limit(closed_loop: &ClosedLoop) -> f64 {
    let fastest = 1.0 / closed_loop.period;
    largest_stable(1e-4 * fastest, fastest, 1.15, |bandwidth| {
        let tuning = Tuning { level_bandwidth: bandwidth, ..Tuning::NONE };
        is_stable(closed_loop, ControlMode::F(Law::Ewma), &tuning, &Conditions::NOMINAL)
    })
    .unwrap_or(0.0)
}

/// Bandwidths of F and P/F, and gains of P/F with estimates: those in the spec are kept, the others follow the rule.
///
/// With active damping, the values of its design, `damped`, replace the rule's start values.
pub(super) fn combined(
    corners: &Corners,
    limit: f64,
    given: TuningKeys,
    damped: Option<&Tuning>,
    ratios: [f64; 2],
) -> Tuning {
    let closed_loop = corners.closed_loop();
    let start = damped.copied().unwrap_or_else(|| start(closed_loop, limit));
    // A mode is fixed if the spec gives all that it uses.
    let (fixed, free): (Vec<ControlMode>, Vec<_>) = [LoopKind::Estimates, LoopKind::Combined]
        .into_iter()
        .flat_map(LoopKind::modes)
        .partition(|mode| (given.gains.is_some() || !mode.feeds_back()) && given.bandwidths.is_some());
    if free.is_empty() {
        return given.over(&start);
    }
    shrink(corners, &free, &fixed, ratios, |factor| given.over(&start.scaled(factor, factor)))
}

/// Start values of the rule.
fn start(closed_loop: &ClosedLoop, limit: f64) -> Tuning {
    let stiffness = &closed_loop.basis.axis_stiffness;
    let level_bandwidth = limit / LEVEL;
    Tuning {
        proportional: stiffness.map(|k| proportional(closed_loop) * k),
        integral: stiffness.map(|k| limit / INTEGRAL * k),
        derivative: [0.0; 6],
        level_bandwidth,
        drift_bandwidth: DRIFT * level_bandwidth,
    }
}

/// Adds active damping and its notch to the loop: the `stored` law of a spec, or a new design. Returns the rule's start values and
/// the law.
pub(super) fn damped(
    closed_loop: &mut ClosedLoop,
    limit: f64,
    adapting: Law,
    stored: Option<DampedLaw>,
    demand: &StructureDemand,
    digest: &str,
) -> (Tuning, DampedLaw) {
    let start = start(closed_loop, limit);
    let law = stored.unwrap_or_else(|| damping::search(closed_loop, adapting, &start, demand, digest));
    closed_loop.active_damping = Some(law.sections);
    let ClosedLoop { basis, damping, period, .. } = closed_loop;
    closed_loop.notch = closed_loop.notch.as_ref().map(|_| Notch::of(basis, damping, &law.notch_damping, *period));
    (start, law)
}

/// Gains of P alone.
pub(super) fn alone(corners: &Corners, limit: f64, ratios: [f64; 2]) -> Tuning {
    let closed_loop = corners.closed_loop();
    let stiffness = &closed_loop.basis.axis_stiffness;
    let start = Tuning {
        proportional: stiffness.map(|k| proportional(closed_loop) * k),
        integral: stiffness.map(|k| limit / INTEGRAL_ALONE * k),
        ..Tuning::NONE
    };
    shrink(corners, &LoopKind::Position.modes(), &[], ratios, |factor| start.scaled(factor, factor))
}

/// The values of a tuning in the spec.
#[derive(Debug, Clone, Copy)]
pub(super) struct TuningKeys<'a> {
    pub(super) gains: Option<&'a Tuning>,
    /// Ω1, Ω2.
    pub(super) bandwidths: Option<[f64; 2]>,
}

impl TuningKeys<'_> {
    /// The rule's values, replaced by those of the spec.
    fn over(&self, rule: &Tuning) -> Tuning {
        let mut tuning = *rule;
        if let Some(gains) = self.gains {
            tuning.proportional = gains.proportional;
            tuning.integral = gains.integral;
            tuning.derivative = gains.derivative;
        }
        if let Some([level, drift]) = self.bandwidths {
            tuning.level_bandwidth = level;
            tuning.drift_bandwidth = drift;
        }
        tuning
    }
}

fn proportional(closed_loop: &ClosedLoop) -> f64 {
    if closed_loop.notch.is_some() { PROPORTIONAL } else { PROPORTIONAL_PLAIN }
}

pub(super) fn is_stable(closed_loop: &ClosedLoop, law: ControlMode, tuning: &Tuning, conditions: &Conditions) -> bool {
    closed_loop.spectral_radius(law, tuning, conditions) <= LARGEST_RADIUS
}

/// The first stable tuning on the way down; the last one tried if none is, which the check then refuses.
///
/// If a `fixed` law, with values from the spec, is unstable under a condition, the other laws do not have to be stable under it: the
/// rule cannot fix that.
fn shrink(
    corners: &Corners,
    laws: &[ControlMode],
    fixed: &[ControlMode],
    ratios: [f64; 2],
    tuning: impl Fn(f64) -> Tuning,
) -> Tuning {
    let closed_loop = corners.closed_loop();
    let contacts: &[bool] = if closed_loop.environment == [0.0; 6] { &[false] } else { &[false, true] };
    let mut asked: Vec<Conditions> = ROBUST
        .iter()
        .flat_map(|conditions| contacts.iter().map(|&touching| Conditions { touching, ..*conditions }))
        .chain(nominal_conditions(closed_loop, ratios))
        .collect();
    asked.retain(|conditions| fixed.iter().all(|&law| is_stable(closed_loop, law, &tuning(1.0), conditions)));
    let mut factor = 1.0;
    for _ in 0..SHRINKS {
        let tried = tuning(factor);
        let stable = |law: ControlMode| asked.iter().all(|conditions| is_stable(closed_loop, law, &tried, conditions));
        if laws.iter().all(|&law| stable(law) && corners.tolerates(law, &tried)) {
            return tried;
        }
        factor *= SHRINK;
    }
    tuning(factor)
}
