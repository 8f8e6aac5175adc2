//! The control mode of a spec, the loop that a mode closes, and its numbers.

use serde::Serialize;
use specgen_language::model::{self, AdaptationMode, Model, TaskSpace};
use specgen_runtime::{ControlMode, Law};

/// The mode that a spec starts with.
pub fn start_mode(model: &Model, task: &TaskSpace) -> ControlMode {
    match task.mode {
        model::ControlMode::P => ControlMode::P,
        model::ControlMode::F => ControlMode::F(start_law(model)),
        model::ControlMode::PF => ControlMode::PF(start_law(model)),
    }
}

/// The run-to-run law that a spec starts with.
pub fn start_law(model: &Model) -> Law {
    match model.adaptation.mode {
        AdaptationMode::Invhys => Law::Invhys,
        AdaptationMode::Ewma => Law::Ewma,
        AdaptationMode::Pcc => Law::Pcc,
    }
}

/// The loop that a control mode closes: the modes of a kind are stable, or not, by the same numbers of a spec.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopKind {
    /// Nothing is fed back.
    Open,
    /// The estimates alone, by their bandwidths.
    Estimates,
    /// The pose error, by `gains`, and the estimates.
    Combined,
    /// The pose error alone, by `position_gains`.
    Position,
}

impl LoopKind {
    /// That of a mode.
    pub fn of(mode: ControlMode) -> Self {
        match (mode.feeds_back(), mode.uses_position_gains()) {
            (true, true) => Self::Position,
            (true, false) => Self::Combined,
            (false, _) if mode.law() != Law::Invhys => Self::Estimates,
            (false, _) => Self::Open,
        }
    }

    /// The modes that close it.
    pub fn modes(self) -> Vec<ControlMode> {
        ControlMode::all().filter(|mode| Self::of(*mode) == self).collect()
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
