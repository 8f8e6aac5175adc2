//! Learning of a motion that repeats, on machines that are not their data sheet.

use host_sim::closed_loop::RunError;
use host_sim::coverage::Coverage;
use serde::{Deserialize, Serialize};

use super::Factors;
use crate::learning::{Convergence, Learnable, Motion, Update};
use crate::tuning::TrajectoryChoice;
use specgen_compiler::compile::Compilation;

/// How every machine learns: alike, for none knows what it is.
pub struct Learning {
    /// How far up.
    pub convergence: Convergence,
    pub(super) motion: Motion,
    pub(super) update: Update,
    pub(super) spacing: u32,
    pub(super) passes: usize,
}

/// What a machine learned.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LearningFigures {
    /// Root mean square of the translation's true error as a norm in the best pass, nm.
    pub error_nm: f64,
    /// Passes before it.
    pub passes: u32,
    /// Whether learning ended because the error grew.
    pub grew: bool,
    /// What was measured of the motion in that pass.
    #[serde(flatten)]
    pub coverage: Coverage,
}

impl Learning {
    /// Of a trajectory in so many passes, up to a frequency (Hz) or where every machine within `factors` converges; none if they converge
    /// nowhere, or the controller has no platform.
    ///
    /// # Errors
    /// If the trajectory has no tick, or too many.
    pub fn of(
        compiled: &Compilation,
        trajectory: &TrajectoryChoice,
        factors: &Factors,
        bandwidth: f64,
        passes: u32,
    ) -> Result<Option<Self>, RunError> {
        let model = &compiled.model;
        let Some((task, learnable)) = model.task_space.as_ref().zip(Learnable::of(compiled)) else { return Ok(None) };
        let Some(convergence) = learnable.convergence(factors, bandwidth) else { return Ok(None) };
        let (period, radius) = (model.timing.period, model.geometry.joint_radius());
        let motion = Motion::of(trajectory.of_platform(model, task).as_ref(), period, &task.setpoint.speed, radius)?;
        let spacing = convergence.spacing(period);
        let update = Update::new(&learnable, &motion, &convergence, spacing);
        Ok(Some(Self { convergence, motion, update, spacing, passes: passes as usize }))
    }
}
