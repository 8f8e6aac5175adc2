//! A run watched to its end, limits and faults included: for who counts them instead of rejecting the run.

use std::ops::ControlFlow;

use host_sim::closed_loop::{LEGS, RunError};
use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;

use super::{AT_REST, Case, Kind, Setting};

/// The end of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickErrors {
    /// Since the start of the trajectory, s.
    pub time: f64,
    /// Error of the translation as a norm, m; of legs the root mean square over them.
    pub translation: f64,
    /// Error of the angles as a norm, rad; 0 for legs.
    pub orientation: f64,
    /// The largest error of one leg, m; of a platform as `translation`.
    pub largest: f64,
    /// Status word; a leg that is wanted at rest, where noise alone makes it meet the end of its voltage, is not at a limit.
    pub status: u32,
}

impl Case {
    /// Runs `setting` as [`Case::run`] does, but shows `watch` the end of every tick instead of scoring; it may end the run.
    /// Returns how much of the trajectory it saw.
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
