//! Observes a run to its end, for callers that count limits and faults instead of rejecting the run.

use std::ops::ControlFlow;

use host_sim::closed_loop::{LEGS, RunError};
use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;

use super::{AT_REST, Case, Kind, Setting};

/// Errors at the end of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickErrors {
    /// Time since the start of the trajectory, s.
    pub time: f64,
    /// Translation error as a norm, m; for legs the rms over the legs.
    pub translation: f64,
    /// Error of the angles as a norm, rad; 0 for legs.
    pub orientation: f64,
    /// Largest error of one leg, m; for a platform as `translation`.
    pub largest: f64,
    /// Status word. A leg with a set-point near rest, where noise alone reaches the voltage limit, does not count as limited.
    pub status: u32,
}

impl Case {
    /// Runs `setting` like [`Case::run`], but calls `watch` at the end of every tick instead of scoring; `watch` may end the run.
    /// Returns the observed part of the trajectory.
    ///
    /// # Errors
    /// As [`Case::run`].
    pub fn observe(
        &self,
        worker: &mut Controller,
        setting: &Setting,
        mut watch: impl FnMut(&TickErrors) -> ControlFlow<()>,
    ) -> Result<Coverage, RunError> {
        match &self.kind {
            Kind::Platform { study, .. } => study.run(worker, &setting.words(worker), |moment| {
                let mut parts = [0.0; 2];
                for k in 0..6 {
                    let error = moment.target[k] - moment.tick.pose[k];
                    parts[k / 3] += error * error;
                }
                let [translation, orientation] = parts.map(libm::sqrt);
                let status = moment.tick.status;
                watch(&TickErrors { time: moment.time, translation, orientation, largest: translation, status })
            }),
            Kind::Legs { scenario, trajectory, .. } => {
                worker.configure(&setting.words(worker))?;
                let place = worker.description().output("status")?;
                let at_rest = AT_REST * self.stroke;
                scenario.rig().clone().follow(worker, trajectory.as_ref(), self.period, |sample, words| {
                    let mut status = words.output[place] as u32;
                    let (mut square, mut largest) = (0.0, 0.0);
                    for leg in 0..LEGS {
                        let error = (sample.target[leg] - sample.measured[leg]).abs();
                        square += error * error / LEGS as f64;
                        if error > largest {
                            largest = error;
                        }
                        if sample.target[leg].abs() < at_rest {
                            status &= !(1 << leg);
                        }
                    }
                    let translation = libm::sqrt(square);
                    watch(&TickErrors { time: sample.time, translation, orientation: 0.0, largest, status })
                })
            }
        }
    }
}
