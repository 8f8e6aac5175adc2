//! Learning of a repeated motion on machines that deviate from nominal.

use host_sim::closed_loop::RunError;
use host_sim::coverage::Coverage;
use serde::{Deserialize, Serialize};

use super::Factors;
use crate::learning::{Convergence, Learnable, Motion, Update};
use crate::tuning::TrajectoryChoice;
use specgen_compiler::compile::Compilation;

/// Learning settings, the same for every machine, since the deviation of a machine is unknown.
pub struct Learning {
    /// Band and bound.
    pub convergence: Convergence,
    pub(super) motion: Motion,
    pub(super) update: Update,
    pub(super) spacing: u32,
    pub(super) passes: usize,
}

/// Result of learning on a machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LearningFigures {
    /// Rms true translation error as a norm in the best pass, nm.
    pub error_nm: f64,
    /// Number of passes before it.
    pub passes: u32,
    /// Whether learning ended because the error grew.
    pub grew: bool,
    /// The measured part of the motion in that pass.
    #[serde(flatten)]
    pub coverage: Coverage,
}

impl Learning {
    /// Learning of a trajectory in so many passes, up to a frequency (Hz) or to where every machine within `factors` converges; `None` if they
    /// converge nowhere, or the controller has no platform.
    ///
    /// # Errors
    /// If the trajectory has no ticks, or too many.
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
