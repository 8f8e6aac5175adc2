//! Many runs of one platform from one state: armed and settled once, then cloned, with common noise.
//!
//! A run changes the settings while the controller rests at its bias pose, which is bumpless, and then follows the
//! trajectory as a stream. The plant uses long steps, see [`super::PlatformPlant::step_whole_ticks`], or small ones.

use std::ops::ControlFlow;

use super::linear::Six;
use super::rig::{Bench, BenchState, PlatformRig, Request, Tick};
use super::scenario::PlatformScenario;
use crate::closed_loop::{RunError, ticks_within};
use crate::controller::{Controller, TickController};
use crate::coverage::Coverage;
use crate::trajectory::{PoseTarget, PoseTrajectory};

/// A platform at its bias pose, ready for a trajectory.
pub struct PlatformStudy {
    rig: PlatformRig,
    controller: Controller,
    paused: BenchState,
    interval: f64,
    /// Set-points of each tick with the corresponding true pose.
    targets: Vec<(PoseTarget, Six)>,
    /// Ticks of the whole path.
    path: usize,
}

/// The end of one tick of a run.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Since the start of the trajectory, s.
    pub time: f64,
    /// Bias and trajectory, m and rad from rest.
    pub target: &'a Six,
    /// The tick.
    pub tick: &'a Tick,
}

impl PlatformStudy {
    /// Arms and settles a fork of `controller`, with its configuration, on a plant of `scenario` in steps of whole
    /// ticks or in small ones. Runs follow `trajectory` from there.
    ///
    /// # Errors
    /// As [`PlatformRig::run`].
    pub fn new(
        scenario: &PlatformScenario,
        controller: &Controller,
        trajectory: &dyn PoseTrajectory,
        whole_ticks: bool,
    ) -> Result<Self, RunError> {
        let options = &scenario.options;
        let interval = options.interval;
        let ticks = ticks_within(trajectory.duration(), interval)?;
        let path = ticks_within(trajectory.whole(), interval)?;
        let targets = (1..=ticks).map(|tick| {
            let wanted = trajectory.target(tick as f64 * interval);
            (wanted, options.pose_of(&wanted))
        });
        let mut rig = scenario.rig().clone();
        if whole_ticks {
            rig.plant_mut().step_whole_ticks(interval);
        } else {
            rig.plant_mut().step_small();
        }
        let mut controller = controller.fork();
        let (bench, _) = rig.ready(&mut controller, options)?;
        let paused = bench.pause();
        rig.draw_ahead(ticks);
        Ok(Self { rig, controller, paused, interval, targets: targets.collect(), path })
    }

    /// Ticks of a run.
    pub fn ticks(&self) -> usize {
        self.targets.len()
    }

    /// Length of a run, s.
    pub fn seconds(&self) -> f64 {
        self.targets.len() as f64 * self.interval
    }

    /// A controller for [`PlatformStudy::run`], one for each thread.
    pub fn controller(&self) -> Controller {
        self.controller.fork()
    }

    /// Runs the trajectory with the settings `words`. `watch` gets the end of every tick and may end the run. Returns
    /// the covered part of the path.
    ///
    /// # Errors
    /// If the controller refuses the settings or outputs a voltage that is not finite.
    ///
    /// # Panics
    /// If `controller` is not from [`PlatformStudy::controller`].
    pub fn run(
        &self,
        controller: &mut Controller,
        words: &[u64],
        mut watch: impl FnMut(&Moment) -> ControlFlow<()>,
    ) -> Result<Coverage, RunError> {
        controller.take_over(&self.controller);
        controller.configure(words)?;
        let mut rig = self.rig.clone();
        let mut bench = Bench::resume(&mut rig, controller, self.interval, &self.paused)?;
        for (index, (wanted, target)) in self.targets.iter().enumerate() {
            let tick = bench.tick(&Request::stream(*wanted))?;
            let time = (index + 1) as f64 * self.interval;
            if watch(&Moment { time, target, tick: &tick }).is_break() {
                return Ok(Coverage::new(index + 1, self.path, self.interval));
            }
        }
        Ok(Coverage::new(self.targets.len(), self.path, self.interval))
    }
}
