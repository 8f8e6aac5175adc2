//! Runs a plan in parallel; results are in the order of the plan.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use host_sim::closed_loop::RunError;
use host_sim::controller::Controller;
use host_sim::coverage::Coverage;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::{Bench, Noise};
use serde::{Deserialize, Deserializer, Serialize};

use super::learning::{Learning, LearningFigures};
use super::plan::{Member, Plan};
use crate::learning::{LearnError, Learner, learn};
use crate::machine;
use crate::tuning::{Case, Conditions, Setting, TrajectoryChoice};
use specgen_compiler::compile::Compilation;

/// Status bits of legs at a limit of voltage or slew.
const LIMITS: u32 = 0x3f;
/// Status bits of implausible gauges or forces, and of refused or stale set-points.
const FAULTS: u32 = 0x3f00 | 0x1_0000 | 0x2_0000 | 0x8_0000;

/// Figures of a run that stayed within the bound. No figure is negative; an overflow is infinite, `null` in JSON.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Figures {
    /// Rms translation error as a norm, nm; for legs over time and legs.
    #[serde(deserialize_with = "or_infinite")]
    pub error_nm: f64,
    /// Largest such error, nm; for legs the largest of one leg.
    #[serde(deserialize_with = "or_infinite")]
    pub peak_nm: f64,
    /// Rms error of the angles as a norm, nrad; 0 for legs.
    #[serde(deserialize_with = "or_infinite")]
    pub orientation_nrad: f64,
    /// Largest such error, nrad.
    #[serde(deserialize_with = "or_infinite")]
    pub orientation_peak_nrad: f64,
    /// Share of ticks with a leg at a limit, %.
    pub limited_percent: f64,
    /// Ticks with an implausible gauge or force, or a refused or stale set-point.
    pub fault_ticks: u64,
    /// Their status bits.
    pub fault_bits: u32,
    /// The measured part of the path.
    #[serde(flatten)]
    pub coverage: Coverage,
    /// Result of learning, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub learned: Option<LearningFigures>,
}

/// JSON has no infinity.
fn or_infinite<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

/// Outcome of a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It stayed within the bound.
    Ran(Figures),
    /// It exceeded the bound, or never reached its bias pose.
    Diverged {
        /// Time since the start of the trajectory, s; `None` before it.
        time: Option<f64>,
        /// As text.
        reason: String,
        /// Share of the ticks before with a leg at a limit, %: insufficient stroke or voltage also exceeds the bound.
        limited_percent: f64,
    },
}

impl Outcome {
    /// The figures of a run that stayed within the bound.
    pub fn figures(&self) -> Option<&Figures> {
        match self {
            Self::Ran(figures) => Some(figures),
            Self::Diverged { .. } => None,
        }
    }
}

/// Outcome of a machine that never started.
fn diverged(why: &dyn fmt::Display) -> Outcome {
    Outcome::Diverged { time: None, reason: why.to_string(), limited_percent: 0.0 }
}

/// Common settings of all members.
pub struct Study<'a> {
    /// The spec.
    pub compiled: &'a Compilation,
    /// Its host library.
    pub controller: &'a Controller,
    /// Leg with the shape of the hysteresis.
    pub leg: &'a LegParameters,
    /// The trajectory.
    pub trajectory: TrajectoryChoice,
    /// Learning settings, if the machines learn.
    pub learning: Option<Learning>,
    /// Whether there is noise.
    pub noise: bool,
    /// Error above which a run counts as diverged, m; angles are multiplied by the radius of the platform joints.
    pub bound: f64,
}

impl Study<'_> {
    /// Runs one member; the result is bit-identical on every computer.
    ///
    /// # Errors
    /// If the run cannot be set up or the controller refuses its own settings.
    pub fn run(&self, member: &Member) -> Result<Outcome, RunError> {
        match self.simulate(member) {
            Err(error @ (RunError::NotReady { .. } | RunError::NotFinite { .. })) => Ok(diverged(&error)),
            Ok(Outcome::Ran(figures)) => self.learned(member, figures),
            other => other,
        }
    }

    /// Adds the result of learning, if requested.
    fn learned(&self, member: &Member, figures: Figures) -> Result<Outcome, RunError> {
        let Some(learning) = &self.learning else { return Ok(Outcome::Ran(figures)) };
        match self.learn(learning, member) {
            Ok(learned) => Ok(Outcome::Ran(Figures { learned, ..figures })),
            Err(LearnError::Run(error @ (RunError::NotReady { .. } | RunError::NotFinite { .. }))) => {
                Ok(diverged(&error))
            }
            Err(LearnError::Run(error)) => Err(error),
            Err(error) => Ok(diverged(&format_args!("learning: {error}"))),
        }
    }

    /// Learning result of one machine; `None` for six legs.
    ///
    /// # Errors
    /// If it does not reach its bias pose or does not follow the motion.
    fn learn(&self, learning: &Learning, member: &Member) -> Result<Option<LearningFigures>, LearnError> {
        let model = &self.compiled.model;
        let Some(task) = &model.task_space else { return Ok(None) };
        let specimen = member.deviation.specimen(model, task, self.leg);
        let noise = if self.noise { Noise::of(&specimen) } else { Noise::NONE };
        let scenario = machine::scenario(model, task, &specimen, &noise, member.seed);
        let mut rig = scenario.rig().clone();
        rig.plant_mut().step_whole_ticks(model.timing.period);
        let mut controller = self.controller.fork();
        let latency = member.deviation.delay_ticks as usize;
        let mut bench = Bench::new(&mut rig, &mut controller, model.timing.period, latency)?;
        bench.arm(scenario.options.arming)?;
        let Learning { motion, update, spacing, passes, .. } = learning;
        let learned =
            learn(&mut bench, motion, Learner::Host(update), &[], *spacing, *passes, |_, _| ControlFlow::Continue(()))?;
        let best = &learned.passes[learned.best];
        Ok(Some(LearningFigures {
            error_nm: best.translation_nm,
            passes: learned.best as u32,
            grew: learned.grew(),
            coverage: best.coverage,
        }))
    }

    fn simulate(&self, member: &Member) -> Result<Outcome, RunError> {
        let Self { compiled, controller, leg, .. } = *self;
        let model = &compiled.model;
        let setting = Setting::of(compiled);
        let conditions = Conditions {
            trajectory: self.trajectory,
            noise: self.noise.then_some(member.seed),
            machine: None,
            latency: member.deviation.delay_ticks as usize,
            whole_ticks: true,
        };
        let case = match &model.task_space {
            None => Case::of_legs(model, controller, &member.deviation.legs_of(leg), &conditions)?,
            Some(task) => {
                let specimen = member.deviation.specimen(model, task, leg);
                Case::of_machine(compiled, task, controller, &specimen, &setting, &conditions)?
            }
        };
        let radius = model.geometry.joint_radius();
        let (mut ticks, mut limited) = (0_u64, 0_u64);
        let (mut square, mut turned) = (0.0, 0.0);
        let mut figures = Figures::default();
        let mut lost = None;
        figures.coverage = case.observe(&mut case.worker(), &setting, |seen| {
            // NaN exceeds every bound.
            let kept = seen.largest <= self.bound && seen.orientation * radius <= self.bound;
            ticks += 1;
            limited += u64::from(seen.status & LIMITS != 0);
            if !kept {
                lost = Some(seen.time);
                return ControlFlow::Break(());
            }
            square += seen.translation * seen.translation;
            turned += seen.orientation * seen.orientation;
            let raise = |peak: &mut f64, value: f64| {
                if value > *peak {
                    *peak = value;
                }
            };
            raise(&mut figures.peak_nm, seen.largest * 1e9);
            raise(&mut figures.orientation_peak_nrad, seen.orientation * 1e9);
            figures.fault_ticks += u64::from(seen.status & FAULTS != 0);
            figures.fault_bits |= seen.status & FAULTS;
            ControlFlow::Continue(())
        })?;
        figures.limited_percent = 100.0 * limited as f64 / ticks.max(1) as f64;
        if let Some(time) = lost {
            let reason = format!("error beyond {:.0} nm", self.bound * 1e9);
            let limited_percent = figures.limited_percent;
            return Ok(Outcome::Diverged { time: Some(time), reason, limited_percent });
        }
        let rms = |sum: f64| libm::sqrt(sum / ticks.max(1) as f64) * 1e9;
        figures.error_nm = rms(square);
        figures.orientation_nrad = rms(turned);
        Ok(Outcome::Ran(figures))
    }

    /// Runs a plan in `threads` threads until `stop` is set. Returns the completed runs in the order of the plan. `progress` is
    /// called with the number of completed runs.
    ///
    /// # Errors
    /// As [`Study::run`]; the first error in the order of the plan.
    pub fn run_all(
        &self,
        plan: &Plan,
        threads: usize,
        stop: &AtomicBool,
        mut progress: impl FnMut(usize),
    ) -> Result<Vec<(Member, Outcome)>, RunError> {
        let members = &plan.members;
        let mut outcomes: Vec<Option<Result<Outcome, RunError>>> = members.iter().map(|_| None).collect();
        let next = AtomicUsize::new(0);
        let (sender, receiver) = mpsc::channel();
        std::thread::scope(|scope| {
            for _ in 0..threads.clamp(1, members.len().max(1)) {
                let sender = sender.clone();
                let next = &next;
                scope.spawn(move || {
                    while !stop.load(Ordering::Relaxed) {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        let Some(member) = members.get(index) else { return };
                        // The receiver outlives every sender.
                        let _ = sender.send((index, self.run(member)));
                    }
                });
            }
            drop(sender);
            for (done, (index, outcome)) in receiver.iter().enumerate() {
                outcomes[index] = Some(outcome);
                progress(done + 1);
            }
        });
        let done = members.iter().zip(outcomes);
        done.filter_map(|(member, outcome)| Some(outcome?.map(|outcome| (member.clone(), outcome)))).collect()
    }
}
