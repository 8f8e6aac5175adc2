//! A set of tunable parameters, for the controller and for the analysis.

use host_sim::controller::{Controller, TickController};
use serde::Serialize;

use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::Tuning;
use specgen_language::model::AdaptationMode;

/// Value of the `setpoint_kind` word for leg displacements.
const LEG_SETPOINTS: f64 = 1.0;

/// Parameters of a controller of either kind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(clippy::large_enum_variant)] // A box would prevent `Copy`, and there are only as many as candidates.
pub enum Setting {
    /// Six legs with their own gauges: weights per run.
    Legs {
        /// ω or ω1.
        level: f64,
        /// ω2.
        drift: f64,
    },
    /// A platform: gains with estimates and their bandwidths, and gains without estimates.
    Platform {
        /// Used by P/F and F.
        combined: Tuning,
        /// Used by P and P/F with Invhys, which have no estimates.
        position: Tuning,
        /// Control interval, s.
        period: f64,
    },
}

impl Setting {
    /// The values from the spec or chosen by the compiler.
    pub fn of(compiled: &Compilation) -> Self {
        let model = &compiled.model;
        match &compiled.design {
            Some(design) => {
                Self::Platform { combined: design.combined, position: design.position, period: model.timing.period }
            }
            None => Self::Legs {
                level: model.adaptation.level_weight,
                drift: if model.adaptation.mode == AdaptationMode::Pcc { model.adaptation.drift_weight } else { 0.0 },
            },
        }
    }

    /// The configuration words of `controller` with these parameters, otherwise the spec's.
    ///
    /// Every emitted controller of its kind has all these names; a missing word would be left unchanged.
    pub fn words(&self, controller: &Controller) -> Vec<u64> {
        let mut words = controller.default_config();
        let description = controller.description();
        let mut set = |name: &str, value: f64| {
            let _ = description.set_config(&mut words, name, value);
        };
        match self {
            Self::Legs { level, drift } => {
                set("level_weight", *level);
                set("drift_weight", *drift);
                set("setpoint_kind", LEG_SETPOINTS);
            }
            Self::Platform { combined, position, period } => {
                set("level_weight", combined.level_bandwidth * period);
                set("drift_weight", combined.drift_bandwidth * period);
                for (prefix, tuning) in [("", combined), ("position_", position)] {
                    let groups = [("kp", &tuning.proportional), ("ki", &tuning.integral), ("kv", &tuning.derivative)];
                    for (stem, gains) in groups {
                        for (axis, gain) in gains.iter().enumerate() {
                            set(&format!("{prefix}{stem}[{axis}]"), *gain);
                        }
                    }
                }
            }
        }
        words
    }

    /// The setting with all gains and bandwidths, or weights, times a factor.
    pub(super) fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Legs { level, drift } => Self::Legs { level: level * factor, drift: drift * factor },
            Self::Platform { combined, position, period } => Self::Platform {
                combined: combined.scaled(factor, factor),
                position: position.scaled(factor, factor),
                period,
            },
        }
    }

    /// The gains in use: those of P if `alone`, else of the other modes. Legs have none.
    pub fn tuning(&self, alone: bool) -> Tuning {
        match self {
            Self::Legs { .. } => Tuning::NONE,
            Self::Platform { combined, position, .. } => {
                if alone {
                    *position
                } else {
                    *combined
                }
            }
        }
    }
}
