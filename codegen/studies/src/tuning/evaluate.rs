//! Scores one run of the emitted controller on a simulated machine: (spec, machine and noise, trajectory, settings) →
//! errors, effort, cost, status.
//!
//! Cost (9) of the paper, ∫ (a1 t |h̃| + a2 η²) dt, in one unit: h̃ is the pose error with angles × the radius of the
//! platform joints, µm; η = k_v ḣ̃ + k_p h̃ + k_I ∫h̃ over the axis stiffness, the motion requested by the feedback, µm. Legs
//! with their own gauges have no feedback: |h̃| is the rms over the legs and η the change of the estimates per
//! tick, µm rms.

mod observe;

use std::ops::ControlFlow;

use host_sim::closed_loop::{LEGS, RunError, ticks_within};
use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::rig::Noise;
use host_sim::platform::study::PlatformStudy;
use host_sim::platform::{PlatformScenario, Specimen};
use host_sim::scenario::LegScenario;
use host_sim::trajectory::{LegTrajectory, Multisine, PaperLeg, PaperPath, PaperPose, PoseTrajectory, Reading, Step};
use serde::Serialize;

pub use observe::TickErrors;

use super::Setting;
use super::space::axis_stiffness;
use crate::machine;
use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::{Tuning, start_mode};
use specgen_language::model::{Model, TaskSpace};

/// a1 and a2 of (9), Table 3.
pub const COST_WEIGHTS: [f64; 2] = [0.998, 0.002];
/// Status bits that prevent scoring: a leg at a limit, an implausible gauge, a refused or stale set-point.
const NOT_SCORED: u32 = 0x3f | 0x3f00 | 0x1_0000 | 0x2_0000;
/// A leg with a set-point within this share of the stroke from rest is at the end of its voltage range, where noise alone
/// reaches the limit: this does not count against the settings.
const AT_REST: f64 = 0.02;
/// Share of stroke and workspace used by the multisine.
const REACH: f64 = 0.3;

/// The trajectory to follow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum TrajectoryChoice {
    /// Five sines on every coordinate, the fastest with this frequency (Hz), for this time (s), with phases from a seed.
    Multisine {
        /// Hz.
        frequency: f64,
        /// s.
        seconds: f64,
        /// Seed of the phases.
        seed: u64,
        /// Replace the fastest sine by a zigzag.
        corners: bool,
    },
    /// The paper's: that of section 3 for legs, a path of section 4 for a platform, at an operating frequency (Hz).
    Paper {
        /// Path of a platform.
        #[serde(skip)]
        path: PaperPath,
        /// Hz.
        frequency: f64,
    },
    /// A step from the spec.
    Step(Step),
}

impl TrajectoryChoice {
    /// The trajectory for the platform of a spec.
    pub fn of_platform(self, model: &Model, task: &TaskSpace) -> Box<dyn PoseTrajectory> {
        match self {
            Self::Step(step) => Box::new(step),
            Self::Paper { path, frequency } => Box::new(PaperPose { path, reading: Reading::Corrected, frequency }),
            Self::Multisine { frequency, seconds, seed, corners } => {
                let sines = Multisine::new(seconds, frequency, [0.0; 6], reach(model, task), seed);
                Box::new(if corners { sines.with_corners() } else { sines })
            }
        }
    }
}

/// Conditions of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conditions {
    /// The trajectory.
    pub trajectory: TrajectoryChoice,
    /// Seed of the noise; `None` for no noise.
    pub noise: Option<u64>,
    /// Seed of the machine's tolerances; `None` for a nominal machine. Not used for legs with their own gauges.
    pub machine: Option<u64>,
    /// Delay of the voltages in control intervals.
    pub latency: usize,
    /// Integrate in steps of one control interval, as usual, or in the small steps used to verify them.
    pub whole_ticks: bool,
}

/// A scored run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// Rms |h̃|, nm: the error on the Pareto front.
    pub error_nm: f64,
    /// Rms translation (nm) and angles (nrad), as norms; for legs the leg error only.
    pub translation_nm: f64,
    /// See `translation_nm`; 0 for legs.
    pub orientation_nrad: f64,
    /// Largest |h̃|, nm.
    pub peak_nm: f64,
    /// Rms η, nm.
    pub effort_nm: f64,
    /// (9), µm s².
    pub cost: f64,
    /// The measured part of the path.
    #[serde(flatten)]
    pub coverage: Coverage,
}

/// Result for one setting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Evaluation {
    /// The run was completed.
    Scored(Score),
    /// It reached a limit at a time (s); the status word says which.
    Limited {
        /// Time since the start of the trajectory, s.
        time: f64,
        /// The controller's status word.
        status: u32,
    },
}

impl Evaluation {
    /// The score of a completed run.
    pub fn score(&self) -> Option<&Score> {
        match self {
            Self::Scored(score) => Some(score),
            Self::Limited { .. } => None,
        }
    }
}

/// A prepared machine and a trajectory, on which any number of settings can run in parallel.
pub struct Case {
    kind: Kind,
    period: f64,
    stroke: f64,
}

#[allow(clippy::large_enum_variant)] // One per case, never in a list.
enum Kind {
    Platform {
        study: PlatformStudy,
        radius: f64,
        stiffness: [f64; 6],
        alone: bool,
    },
    Legs {
        scenario: LegScenario,
        controller: Controller,
        trajectory: Box<dyn LegTrajectory + Sync + Send>,
        ticks: usize,
    },
}

impl Case {
    /// A case of a compiled spec. `controller` is its host library, `leg` gives the shape of the hysteresis; a platform starts with
    /// the setting `start`.
    ///
    /// # Errors
    /// If the machine does not reach its bias pose, or the trajectory has no ticks.
    pub fn new(
        compiled: &Compilation,
        controller: &Controller,
        leg: &LegParameters,
        start: &Setting,
        conditions: &Conditions,
    ) -> Result<Self, RunError> {
        let model = &compiled.model;
        match &model.task_space {
            None => Self::of_legs(model, controller, &std::array::from_fn(|_| leg.clone()), conditions),
            Some(task) => {
                let specimen = machine::specimen(model, task, leg, conditions.machine);
                Self::of_machine(compiled, task, controller, &specimen, start, conditions)
            }
        }
    }

    /// A case of six given legs with their own gauges; `conditions.machine` has no effect.
    ///
    /// # Errors
    /// As [`Case::new`].
    pub fn of_legs(
        model: &Model,
        controller: &Controller,
        legs: &[LegParameters; LEGS],
        conditions: &Conditions,
    ) -> Result<Self, RunError> {
        let noise = if conditions.noise.is_some() { legs[0].noise } else { NoiseParameters::NONE };
        let mut scenario = machine::legs(model, legs, &noise, conditions.noise.unwrap_or_default(), 1);
        let trajectory: Box<dyn LegTrajectory + Sync + Send> = match conditions.trajectory {
            TrajectoryChoice::Paper { frequency, .. } => Box::new(PaperLeg { frequency }),
            TrajectoryChoice::Step(Step { time, .. }) => Box::new(PaperLeg { frequency: 1.0 / time }),
            TrajectoryChoice::Multisine { frequency, seconds, seed, corners } => {
                let stroke = model.actuator.stroke;
                let sines = Multisine::new(seconds, frequency, [0.4 * stroke; 6], [REACH * stroke; 6], seed);
                Box::new(if corners { sines.with_corners() } else { sines })
            }
        };
        let period = model.timing.period;
        let ticks = ticks_within(trajectory.duration(), period)?;
        scenario.rig_mut().draw_ahead(ticks);
        scenario.rig_mut().set_latency(conditions.latency);
        let controller = controller.fork();
        let stroke = model.actuator.stroke;
        Ok(Self { kind: Kind::Legs { scenario, controller, trajectory, ticks }, period, stroke })
    }

    /// A case of a platform on a given machine, which may deviate from the spec.
    ///
    /// # Errors
    /// As [`Case::new`].
    pub fn of_machine(
        compiled: &Compilation,
        task: &TaskSpace,
        controller: &Controller,
        specimen: &Specimen,
        start: &Setting,
        conditions: &Conditions,
    ) -> Result<Self, RunError> {
        let model = &compiled.model;
        let noise = if conditions.noise.is_some() { Noise::of(specimen) } else { Noise::NONE };
        let mut scenario: PlatformScenario =
            machine::scenario(model, task, specimen, &noise, conditions.noise.unwrap_or_default());
        scenario.options.latency = conditions.latency;
        let trajectory = conditions.trajectory.of_platform(model, task);
        let mut armed = controller.fork();
        armed.configure(&start.words(&armed))?;
        let study = PlatformStudy::new(&scenario, &armed, trajectory.as_ref(), conditions.whole_ticks)?;
        let stiffness = axis_stiffness(model);
        let alone = start_mode(model, task).uses_position_gains();
        Ok(Self {
            kind: Kind::Platform { study, radius: model.geometry.joint_radius(), stiffness, alone },
            period: model.timing.period,
            stroke: model.actuator.stroke,
        })
    }

    /// A controller for [`Case::run`], one per thread.
    pub fn worker(&self) -> Controller {
        match &self.kind {
            Kind::Platform { study, .. } => study.controller(),
            Kind::Legs { controller, .. } => controller.fork(),
        }
    }

    /// Simulated time of one run, s.
    pub fn seconds(&self) -> f64 {
        match &self.kind {
            Kind::Platform { study, .. } => study.seconds(),
            Kind::Legs { ticks, .. } => *ticks as f64 * self.period,
        }
    }

    /// Runs `setting`; the result is bit-identical for every worker of this case.
    ///
    /// # Errors
    /// If the controller refuses the settings or a voltage is not finite.
    pub fn run(&self, worker: &mut Controller, setting: &Setting) -> Result<Evaluation, RunError> {
        match &self.kind {
            Kind::Platform { study, radius, stiffness, alone } => {
                let tuning = setting.tuning(*alone);
                self.platform(study, worker, &setting.words(worker), &tuning, *radius, stiffness)
            }
            Kind::Legs { scenario, trajectory, .. } => {
                worker.configure(&setting.words(worker))?;
                self.legs(scenario, worker, trajectory.as_ref())
            }
        }
    }

    fn platform(
        &self,
        study: &PlatformStudy,
        worker: &mut Controller,
        words: &[u64],
        tuning: &Tuning,
        radius: f64,
        stiffness: &[f64; 6],
    ) -> Result<Evaluation, RunError> {
        let mut sums = Sums::default();
        let mut limited = None;
        let scale = [1.0, 1.0, 1.0, radius, radius, radius];
        let factor = |gains: &[f64; 6]| -> [f64; 6] { std::array::from_fn(|k| gains[k] / stiffness[k] * scale[k]) };
        let (kp, ki, kv) = (factor(&tuning.proportional), factor(&tuning.integral), factor(&tuning.derivative));
        let (mut integral, mut last, mut target) = ([0.0; 6], [0.0; 6], None::<[f64; 6]>);
        let coverage = study.run(worker, words, |moment| {
            if moment.tick.status & NOT_SCORED != 0 {
                limited = Some(Evaluation::Limited { time: moment.time, status: moment.tick.status });
                return ControlFlow::Break(());
            }
            // The error at the start of the tick, relative to the set-point at that time.
            let mut effort = 0.0;
            if let Some(target) = target {
                for k in 0..6 {
                    let error = target[k] - moment.tick.measured[k];
                    integral[k] += error * self.period;
                    let eta = kp[k] * error + ki[k] * integral[k] + kv[k] * (error - last[k]) / self.period;
                    last[k] = error;
                    effort += eta * eta;
                }
            }
            target = Some(moment.tick.target);
            let mut parts = [0.0; 2];
            for k in 0..6 {
                let error = moment.target[k] - moment.tick.pose[k];
                parts[k / 3] += error * error;
            }
            sums.add(moment.time, parts[0], parts[1], radius, effort, self.period);
            ControlFlow::Continue(())
        })?;
        Ok(limited.unwrap_or_else(|| Evaluation::Scored(sums.score(coverage))))
    }

    fn legs(
        &self,
        scenario: &LegScenario,
        worker: &mut Controller,
        trajectory: &dyn LegTrajectory,
    ) -> Result<Evaluation, RunError> {
        let scalar = worker.description().scalar;
        let mut places = [[0; 2]; LEGS];
        for (leg, place) in places.iter_mut().enumerate() {
            let find = |stem: &str| worker.description().output(&format!("{stem}[{leg}]"));
            *place = [find("level")?, find("drift")?];
        }
        let status_place = worker.description().output("status")?;
        let mut sums = Sums::default();
        let mut limited = None;
        let mut last = [0.0; LEGS];
        let at_rest = AT_REST * self.stroke;
        let coverage = scenario.rig().clone().follow(worker, trajectory, self.period, |sample, words| {
            let mut status = words.output[status_place] as u32;
            for (leg, target) in sample.target.iter().enumerate() {
                if target.abs() < at_rest {
                    status &= !(1 << leg);
                }
            }
            if status & NOT_SCORED != 0 {
                limited = Some(Evaluation::Limited { time: sample.time, status });
                return ControlFlow::Break(());
            }
            let (mut square, mut effort) = (0.0, 0.0);
            for leg in 0..LEGS {
                let error = sample.target[leg] - sample.measured[leg];
                let [level, drift] = places[leg].map(|place| scalar.decode(words.output[place]));
                square += error * error / LEGS as f64;
                let change = level + drift - last[leg];
                last[leg] = level + drift;
                effort += change * change / LEGS as f64;
            }
            sums.add(sample.time, square, 0.0, 0.0, effort, self.period);
            ControlFlow::Continue(())
        })?;
        Ok(limited.unwrap_or_else(|| Evaluation::Scored(sums.score(coverage))))
    }
}

/// Amplitudes of the multisine of a platform, m and rad: limited by the stroke, by the workspace left beside the
/// bias, and by the stream speed.
fn reach(model: &Model, task: &TaskSpace) -> [f64; 6] {
    let stroke = model.actuator.stroke;
    let radius = model.geometry.joint_radius();
    std::array::from_fn(|axis| {
        let (bound, share) = if axis < 3 {
            (model.workspace.translation[axis], 0.2 * stroke)
        } else {
            (model.workspace.rotation[axis - 3], 0.05 * stroke / radius)
        };
        let room = 0.9 * (bound - task.setpoint.bias[axis].abs());
        // Downwards at most half of the bias in z: a leg cannot be shorter than at rest.
        let down = if axis == 2 && task.setpoint.bias[2] > 0.0 { 0.5 * task.setpoint.bias[2] } else { share };
        REACH_OF_AXIS[axis] * [room, share, down].into_iter().fold(f64::INFINITY, |a, b| if b < a { b } else { a })
    })
}

/// x and y drive the legs against each other, so they get half.
const REACH_OF_AXIS: [f64; 6] = [0.5, 0.5, 0.8, 0.6, 0.6, 0.6];

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: usize,
    translation: f64,
    orientation: f64,
    square: f64,
    peak: f64,
    effort: f64,
    cost: f64,
}

impl Sums {
    /// Adds the squares of a tick: translation m², angles rad² with their radius (m), effort m².
    fn add(&mut self, time: f64, translation: f64, orientation: f64, radius: f64, effort: f64, period: f64) {
        let square = translation + orientation * radius * radius;
        let norm = square.sqrt();
        self.count += 1;
        self.translation += translation;
        self.orientation += orientation;
        self.square += square;
        self.effort += effort;
        if norm > self.peak {
            self.peak = norm;
        }
        let [a1, a2] = COST_WEIGHTS;
        self.cost += (a1 * time * norm * 1e6 + a2 * effort * 1e12) * period;
    }

    /// The score of a completed run.
    fn score(&self, coverage: Coverage) -> Score {
        let rms = |sum: f64| libm::sqrt(sum / self.count.max(1) as f64) * 1e9;
        Score {
            error_nm: rms(self.square),
            translation_nm: rms(self.translation),
            orientation_nrad: rms(self.orientation),
            peak_nm: self.peak * 1e9,
            effort_nm: rms(self.effort),
            cost: self.cost,
            coverage,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (9) computed manually: error h̃ = (3, 0, 0) µm and 40 µrad at a radius of 0.1 m, |h̃| = 5 µm, at 0.5 s; effort η = 2 µm.
    #[test]
    fn the_cost_is_the_time_weighted_error_and_the_square_of_the_effort() {
        let mut sums = Sums::default();
        sums.add(0.5, 9e-12, 1.6e-9, 0.1, 4e-12, 1e-4);
        let expected = (0.998 * 0.5 * 5.0 + 0.002 * 4.0) * 1e-4;
        let score = |sums: &Sums| sums.score(Coverage::new(1, 1, 1e-4));
        assert!((score(&sums).cost - expected).abs() < 1e-15, "{} {expected}", score(&sums).cost);
        sums.add(1.0, 9e-12, 1.6e-9, 0.1, 0.0, 1e-4);
        assert!((score(&sums).cost - expected - 0.998 * 5.0 * 1e-4).abs() < 1e-15);
        assert!((score(&sums).error_nm - 5000.0).abs() < 1e-9);
    }
}
