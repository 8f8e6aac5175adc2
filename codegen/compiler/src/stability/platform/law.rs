//! The control modes of a platform controller and their numbers.

use serde::{Serialize, Serializer};

/// The estimates of F in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// None: inverse Preisach model alone.
    Invhys,
    /// δ̂.
    Ewma,
    /// δ̂ and φ̂.
    Pcc,
}

/// A control mode: what a running controller can be switched to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// P alone.
    Position,
    /// F alone.
    Feedforward(Estimator),
    /// P/F.
    Combined(Estimator),
}

impl Law {
    /// Every mode, in the order of the word `mode`.
    pub const ALL: [Self; 7] = [
        Self::Position,
        Self::Feedforward(Estimator::Invhys),
        Self::Feedforward(Estimator::Ewma),
        Self::Feedforward(Estimator::Pcc),
        Self::Combined(Estimator::Invhys),
        Self::Combined(Estimator::Ewma),
        Self::Combined(Estimator::Pcc),
    ];

    /// Its name for users.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "P",
            Self::Feedforward(Estimator::Invhys) => "F invhys",
            Self::Feedforward(Estimator::Ewma) => "F ewma",
            Self::Feedforward(Estimator::Pcc) => "F pcc",
            Self::Combined(Estimator::Invhys) => "P/F invhys",
            Self::Combined(Estimator::Ewma) => "P/F ewma",
            Self::Combined(Estimator::Pcc) => "P/F pcc",
        }
    }

    /// Whether the pose error is fed back.
    pub(super) fn feeds_back(self) -> bool {
        !matches!(self, Self::Feedforward(_))
    }

    /// Whether active damping acts.
    pub(super) fn damps_modes(self) -> bool {
        matches!(self, Self::Combined(_))
    }

    /// The estimates in use.
    pub(super) fn adapting(self) -> Estimator {
        match self {
            Self::Position => Estimator::Invhys,
            Self::Feedforward(adapting) | Self::Combined(adapting) => adapting,
        }
    }
}

impl Serialize for Law {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Gains in pose coordinates and bandwidths of the adaptation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tuning {
    /// k_p, N/m and N m/rad.
    pub proportional: [f64; 6],
    /// k_I, N/(m s) and N m/(rad s).
    pub integral: [f64; 6],
    /// k_v, N s/m and N m s/rad.
    pub derivative: [f64; 6],
    /// Ω1, rad/s: the level weight per tick is Ω1 T_s.
    pub level_bandwidth: f64,
    /// Ω2, rad/s: likewise for the drift.
    pub drift_bandwidth: f64,
}

impl Tuning {
    /// No feedback at all.
    pub const NONE: Self = Self {
        proportional: [0.0; 6],
        integral: [0.0; 6],
        derivative: [0.0; 6],
        level_bandwidth: 0.0,
        drift_bandwidth: 0.0,
    };

    /// Gains × `gains`, bandwidths × `bandwidths`.
    #[must_use]
    pub fn scaled(&self, gains: f64, bandwidths: f64) -> Self {
        Self {
            proportional: self.proportional.map(|x| x * gains),
            integral: self.integral.map(|x| x * gains),
            derivative: self.derivative.map(|x| x * gains),
            level_bandwidth: self.level_bandwidth * bandwidths,
            drift_bandwidth: self.drift_bandwidth * bandwidths,
        }
    }
}
