//! Whether a setting is stable with the required margins: others are never simulated.

use specgen_compiler::compile::Compilation;
use specgen_compiler::lower::platform;
use specgen_compiler::stability::platform::{
    ClosedLoop, Conditions, Corners, LARGEST_RADIUS, LoopKind, RestDynamics, StructureDemand, Tuning, start_mode,
};
use specgen_compiler::stability::{LegDynamics, ewma_limit, pcc_limit, spectral_radius};
use specgen_language::model::{Adaptation, AdaptationMode};
use specgen_runtime::ControlMode;

use super::{Setting, Space};

/// Number of values of λ per candidate: the limits of the interval, which are the worst cases. The compiler checks more
/// when the result is written.
const ENDS: usize = 2;

/// Factor per reduction of a setting until it meets the margins, and the largest number of reductions.
const SHRINK: f64 = 0.85;
const SHRINKS: usize = 40;

/// Required stability margins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RequiredMargins {
    /// Factor on all gains and bandwidths, or weights, for which the loop must be stable; at least 1.
    pub gain: f64,
    /// Additional delay for which the loop must be stable, ticks. For a platform.
    pub delay: f64,
}

/// Decides on settings of one spec.
#[derive(Debug, Clone)]
pub enum Feasibility {
    /// Six legs with their own gauges.
    Legs {
        /// Dynamics of each leg.
        dynamics: LegDynamics,
        /// The spec's adaptation, whose weights a candidate replaces.
        adaptation: Adaptation,
        /// The required margins.
        required: RequiredMargins,
    },
    /// A platform.
    Platform {
        /// The closed loop without the tuned settings, with the structural modes that it must tolerate.
        corners: Box<Corners>,
        /// Control modes that use the tuned parameters.
        laws: Vec<ControlMode>,
        /// λ.
        ratios: [f64; 2],
        /// The required margins.
        required: RequiredMargins,
    },
}

impl Feasibility {
    /// For a compiled spec.
    pub fn of(compiled: &Compilation, required: RequiredMargins) -> Self {
        let model = &compiled.model;
        let legs = || Self::Legs { dynamics: LegDynamics::of(model), adaptation: model.adaptation.clone(), required };
        let Some(task) = &model.task_space else { return legs() };
        // Compilation computed both, so neither can be missing.
        let rest = platform(model).map(|platform| RestDynamics::of(&platform));
        let design = compiled.design.as_ref();
        let Some(closed_loop) = rest.ok().and_then(|rest| design?.closed_loop(model, task, &rest)) else {
            return legs();
        };
        // A running controller may be switched to any of them; the one of the spec is asked first.
        let own = start_mode(model, task);
        let mut laws = vec![own];
        let kinds: &[LoopKind] =
            if own.uses_position_gains() { &[LoopKind::Position] } else { &[LoopKind::Estimates, LoopKind::Combined] };
        laws.extend(kinds.iter().copied().flat_map(LoopKind::modes).filter(|law| *law != own));
        let demand = StructureDemand::of(model, &closed_loop.basis);
        let corners = Box::new(Corners::of(closed_loop, demand));
        Self::Platform { corners, laws, ratios: model.adaptation.gain_ratio, required }
    }

    /// Whether `setting` is stable with the margins.
    pub fn holds(&self, setting: &Setting) -> bool {
        match (self, setting) {
            (Self::Legs { dynamics, adaptation, required }, Setting::Legs { level, drift }) => {
                leg_holds(dynamics, adaptation, required, *level, *drift)
            }
            (Self::Platform { corners, laws, ratios, required }, Setting::Platform { period, .. }) => {
                let tuning = |law: &ControlMode| setting.tuning(law.uses_position_gains());
                laws.iter()
                    .all(|law| platform_holds(corners.closed_loop(), *law, &tuning(law), *ratios, required, *period))
                    && laws.iter().all(|law| corners.tolerates(*law, &tuning(law)))
            }
            _ => false,
        }
    }

    /// The tuned parameters of a setting, within their bounds and reduced until they meet the margins; `None` if no reduction does.
    pub fn reduce(&self, space: &Space, setting: Setting) -> Option<Setting> {
        let bounded = |setting| space.setting(&space.genes(&setting));
        let settings = std::iter::successors(Some(bounded(setting)), |last| Some(bounded(last.scaled(SHRINK))));
        settings.take(1 + SHRINKS).find(|setting| self.holds(setting))
    }
}

fn leg_holds(
    dynamics: &LegDynamics,
    adaptation: &Adaptation,
    required: &RequiredMargins,
    level: f64,
    drift: f64,
) -> bool {
    let with_drift = adaptation.mode == AdaptationMode::Pcc;
    let [low, high] = adaptation.gain_ratio;
    // Scaling the weights scales the loop gain.
    let stable = |scale: f64, ratio: f64| {
        let (level, drift) = (level * scale, drift * scale);
        if level > 1.0 || drift > 1.0 {
            return scale > 1.0;
        }
        let inside = ratio < ewma_limit(level) && (!with_drift || ratio < pcc_limit(level, drift));
        inside
            && spectral_radius(dynamics, level, with_drift.then_some(drift), ratio) <= LARGEST_RADIUS
            // The law may be switched to EWMA with the same weight.
            && spectral_radius(dynamics, level, None, ratio) <= LARGEST_RADIUS
    };
    level > 0.0
        && (0..ENDS).all(|end| stable(1.0, if end == 0 { high } else { low }))
        && stable(1.0, 0.5 * (low + high))
        && stable(required.gain, high)
}

fn platform_holds(
    closed_loop: &ClosedLoop,
    law: ControlMode,
    tuning: &Tuning,
    [low, high]: [f64; 2],
    required: &RequiredMargins,
    period: f64,
) -> bool {
    let most =
        if tuning.level_bandwidth > tuning.drift_bandwidth { tuning.level_bandwidth } else { tuning.drift_bandwidth };
    if most * period > 1.0 {
        return false;
    }
    let contacts: &[bool] = if closed_loop.environment == [0.0; 6] { &[false] } else { &[false, true] };
    let scaled = tuning.scaled(required.gain, required.gain);
    contacts.iter().all(|&touching| {
        let at = |tuning: &Tuning, conditions: Conditions| {
            closed_loop.spectral_radius(law, tuning, &Conditions { touching, ..conditions }) <= LARGEST_RADIUS
        };
        // Check the margins first, since most candidates fail there.
        at(&scaled, Conditions::NOMINAL)
            && at(tuning, Conditions { delay: required.delay, ..Conditions::NOMINAL })
            && at(tuning, Conditions { gain_ratio: high, ..Conditions::NOMINAL })
            && at(tuning, Conditions { gain_ratio: low, ..Conditions::NOMINAL })
    })
}
