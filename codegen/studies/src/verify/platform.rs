//! The exercise of a task-space controller: closed loop with a simulated machine, on streamed set-points.

use std::f64::consts::TAU;

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::plant::LegParameters;
use host_sim::platform::PlatformRig;
use host_sim::platform::rig::{BUSY, Bench, Noise, Request};
use host_sim::trace::Trace;
use host_sim::trajectory::PoseTarget;

use super::SEED;
use crate::machine;
use specgen_language::model::{Model, TaskSpace};

/// Moves to the bias pose, then streams a motion of all six axes.
pub(super) fn exercise(
    controller: &mut dyn TickController,
    model: &Model,
    task: &TaskSpace,
    ticks: u32,
) -> Result<Trace, RunError> {
    let mut rig = rig(model, task);
    let mut bench = Bench::new(&mut rig, controller, model.timing.period, 0)?;
    bench.record();
    let mut busy = true;
    let mut streamed = 0;
    for _ in 0..ticks {
        let request = if busy {
            Request::default()
        } else {
            streamed += 1;
            Request::stream(motion(model, task, f64::from(streamed) * model.timing.period))
        };
        busy = bench.tick(&request)?.status & BUSY != 0;
    }
    bench.into_trace().ok_or(RunError::Timing { interval: model.timing.period, duration: 0.0 })
}

/// Amplitude of a streamed axis as a share of the free workspace: along z, and for the other axes. Small where the legs
/// could reach their lower end.
const SWING: [f64; 2] = [0.2, 0.03];

/// A motion from rest, by a share of the free workspace.
fn motion(model: &Model, task: &TaskSpace, time: f64) -> PoseTarget {
    let mut target = PoseTarget::default();
    for (axis, bound) in model.workspace.bounds().into_iter().enumerate() {
        let amplitude = SWING[usize::from(axis != 2)] * (bound - task.setpoint.bias[axis].abs());
        let frequency = TAU * (2.0 + 0.7 * axis as f64);
        let (sine, cosine) = libm::sincos(frequency * time);
        target.pose[axis] = amplitude * (1.0 - cosine);
        target.rate[axis] = amplitude * frequency * sine;
        target.acceleration[axis] = amplitude * frequency * frequency * cosine;
    }
    target
}

/// The machine of the spec with tolerances, pre-cycled and zeroed.
fn rig(model: &Model, task: &TaskSpace) -> PlatformRig {
    let specimen = machine::specimen(model, task, &LegParameters::reference(), Some(SEED));
    machine::scenario(model, task, &specimen, &Noise::of(&specimen), SEED).rig().clone()
}
