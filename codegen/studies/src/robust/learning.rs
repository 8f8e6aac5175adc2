//! Learning of a motion that repeats, on machines that are not their data sheet.

use std::ops::ControlFlow;

use host_sim::closed_loop::RunError;
use host_sim::platform::rig::{Bench, Noise};
use serde::{Deserialize, Serialize};

use super::{Factors, Member, Study};
use crate::learning::{Convergence, LearnError, Learnable, Learner, Motion, Update, learn};
use crate::machine;
use crate::tuning::TrajectoryChoice;
use specgen_compiler::compile::Compiled;

/// How every machine learns: alike, for none knows what it is.
pub struct Learning {
    /// How far up.
    pub convergence: Convergence,
    motion: Motion,
    update: Update,
    spacing: u32,
    passes: usize,
}

/// What a machine learned.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Learnt {
    /// Root mean square of the translation's true error as a norm in the best pass, nm.
    pub error_nm: f64,
    /// Passes before it.
    pub passes: u32,
    /// Whether learning ended because the error grew.
    pub grew: bool,
}

impl Learning {
    /// Of a trajectory in so many passes, up to a frequency (Hz) or where every machine within `factors` converges; none if they converge
    /// nowhere, or the controller has no platform.
    ///
    /// # Errors
    /// If the trajectory has no tick, or too many.
    pub fn of(
        compiled: &Compiled,
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

    /// On one machine.
    ///
    /// # Errors
    /// If it does not come to its bias pose, or does not make the motion.
    pub(super) fn on(&self, study: &Study<'_>, member: &Member) -> Result<Option<Learnt>, LearnError> {
        let model = &study.compiled.model;
        let Some(task) = &model.task_space else { return Ok(None) };
        let specimen = member.deviation.specimen(model, task, study.leg);
        let noise = if study.noise { Noise::of(&specimen) } else { Noise::NONE };
        let scenario = machine::scenario(model, task, &specimen, &noise, member.seed);
        let mut rig = scenario.rig().clone();
        rig.plant_mut().step_whole_ticks(model.timing.period);
        let mut controller = study.controller.fork();
        let latency = member.deviation.delay_ticks as usize;
        let mut bench = Bench::new(&mut rig, &mut controller, model.timing.period, latency)?;
        bench.arm(scenario.options.arming)?;
        let learned =
            learn(&mut bench, &self.motion, Learner::Host(&self.update), &[], self.spacing, self.passes, |_, _| {
                ControlFlow::Continue(())
            })?;
        let best = &learned.passes[learned.best];
        Ok(Some(Learnt { error_nm: best.translation_nm, passes: learned.best as u32, grew: learned.grew }))
    }
}
