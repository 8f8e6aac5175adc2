//! A trajectory run with a rig and a controller, scored by the true pose.

use std::fmt::Write as _;

use super::{BUSY, Bench, Command, GaugeFault, NOT_FOLLOWED, PlatformRig, Request, Tick};
use crate::closed_loop::{RunError, ticks_within};
use crate::controller::TickController;
use crate::platform::contact::WorkPart;
use crate::platform::frames::UserFrames;
use crate::platform::linear::Six;
use crate::platform::table::PoseErrors;
use crate::trace::Trace;
use crate::trajectory::{PoseTarget, PoseTrajectory};
use crate::word::status_words;

/// Duration for repeated paths: as many whole repetitions as fit, at least one, s.
const REPEATED: f64 = 60.0;

/// Data of a run besides its errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Record {
    /// Nothing.
    #[default]
    Errors,
    /// A sample per tick of the trajectory.
    Samples,
    /// Samples, and every word from power-up on.
    Trace,
}

/// Settings of a trajectory run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOptions {
    /// Control interval, s.
    pub interval: f64,
    /// Bias pose of the controller: true poses are scored against this plus the trajectory.
    pub bias: Six,
    /// Frames of the controller, in which the trajectory is given; none: parallel to {B}, about P_C.
    pub frames: Option<UserFrames>,
    /// Time limit for the controller to reach its bias pose, s.
    pub arming: f64,
    /// Rest between that and the trajectory, s.
    pub settle: f64,
    /// Delay of voltages, intervals.
    pub latency: usize,
    /// Part that is touched, unloaded, when the trajectory starts.
    pub part: Option<WorkPart>,
    /// Gauge faults: gauge, start and end in the time of the trajectory (s), kind.
    pub faults: Vec<(usize, f64, f64, GaugeFault)>,
    /// What is kept.
    pub record: Record,
}

impl RunOptions {
    /// Free motion at a control interval (s) with a bias pose.
    pub fn new(interval: f64, bias: Six) -> Self {
        Self {
            interval,
            bias,
            frames: None,
            arming: 60.0,
            settle: 0.2,
            latency: 0,
            part: None,
            faults: Vec::new(),
            record: Record::Errors,
        }
    }

    /// The true pose for a set-point, from rest.
    pub(in crate::platform) fn pose_of(&self, wanted: &PoseTarget) -> Six {
        let moved = self.frames.map_or(wanted.pose, |frames| frames.pose(&wanted.pose));
        std::array::from_fn(|k| self.bias[k] + moved[k])
    }
}

/// A trajectory stored in the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnBoard {
    /// Its number.
    pub selector: u32,
    /// Its start, in the user's frames, m and rad; none if that is the bias pose.
    pub approach: Option<Six>,
    /// Ticks of the path; for a repeated path, of one repetition.
    pub ticks: usize,
    /// Whether it begins again at its end.
    pub repeats: bool,
}

impl OnBoard {
    /// Ticks that are followed: the whole path, or at most `limit` (s) of it.
    fn followed(&self, interval: f64, limit: Option<f64>) -> Result<usize, RunError> {
        let limit = limit.map(|limit| ticks_within(limit, interval)).transpose()?;
        let times = if self.repeats { (ticks_within(REPEATED, interval)? / self.ticks.max(1)).max(1) } else { 1 };
        Ok(match limit {
            Some(limit) if self.repeats || limit < self.ticks => limit,
            _ => times * self.ticks,
        })
    }
}

/// The end of one tick of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseSample {
    /// Since the start of the trajectory, s.
    pub time: f64,
    /// Bias and trajectory.
    pub target: Six,
    /// The tick.
    pub tick: Tick,
}

/// A run of a platform.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformRun {
    /// True pose against bias and trajectory, up to where the controller stopped following; see
    /// [`PlatformRun::scored`].
    pub errors: PoseErrors,
    /// One per tick of the trajectory, if they are stored.
    pub samples: Vec<PoseSample>,
    /// Every word, if they are stored.
    pub trace: Option<Trace>,
    /// Union of the status bits during the trajectory.
    pub status: u32,
    /// Time to reach the bias pose, s.
    pub arming: f64,
}

impl PlatformRig {
    /// Runs `controller`, reset to power-up: move to the bias pose, rest, contact, then `trajectory` as a stream.
    ///
    /// # Errors
    /// If the controller lacks a word, does not reach its bias pose, outputs a voltage that is not finite, or there
    /// would be no tick.
    pub fn run(
        &mut self,
        controller: &mut dyn TickController,
        trajectory: &dyn PoseTrajectory,
        options: &RunOptions,
    ) -> Result<PlatformRun, RunError> {
        let interval = options.interval;
        let ticks = ticks_within(trajectory.duration(), interval)?;
        let mut errors = PoseErrors::over(ticks_within(trajectory.whole(), interval)?, interval);
        let (mut bench, arming) = self.ready(controller, options)?;
        let mut samples = Vec::new();
        let mut seen = 0;
        for tick in 0..ticks {
            for &(gauge, from, to, fault) in &options.faults {
                let now = tick as f64 * interval;
                bench.rig().set_fault(gauge, (now >= from && now < to).then_some(fault));
            }
            let time = (tick + 1) as f64 * interval;
            let wanted = trajectory.target(time);
            let tick = bench.tick(&Request::stream(wanted))?;
            let target = options.pose_of(&wanted);
            seen |= tick.status;
            if seen & NOT_FOLLOWED == 0 {
                errors.add(&std::array::from_fn(|k| target[k] - tick.pose[k]));
            }
            if options.record != Record::Errors {
                samples.push(PoseSample { time, target, tick });
            }
        }
        Ok(PlatformRun { errors, samples, trace: bench.into_trace(), status: seen, arming })
    }

    /// Runs `controller` likewise, but lets it play a stored trajectory: moves to its start, then plays it completely,
    /// or at most `limit` (s) of it. True poses are scored against the controller's targets; the move to the start is
    /// not scored. A run with a refused set-point ends there, see [`PlatformRun::is_followed`].
    ///
    /// # Errors
    /// As [`PlatformRig::run`], or if the trajectory does not end with its last set-point.
    pub fn play(
        &mut self,
        controller: &mut dyn TickController,
        path: &OnBoard,
        options: &RunOptions,
        limit: Option<f64>,
    ) -> Result<PlatformRun, RunError> {
        let interval = options.interval;
        let ticks = path.followed(interval, limit)?;
        let (mut bench, arming) = self.ready(controller, options)?;
        let mut seen = path.approach.map_or(Ok(0), |start| bench.move_to(&start, options.arming))?;
        let request = Request { command: Command::Trajectory, selector: path.selector, ..Request::default() };
        let mut errors = PoseErrors::over(path.ticks, interval);
        let mut samples = Vec::new();
        for number in 1..=ticks {
            let tick = bench.tick(&request)?;
            seen |= tick.status & !BUSY;
            if options.record != Record::Errors {
                samples.push(PoseSample { time: number as f64 * interval, target: tick.target, tick });
            }
            if seen & NOT_FOLLOWED != 0 {
                break;
            }
            errors.add(&std::array::from_fn(|k| tick.target[k] - tick.pose[k]));
            let (is_busy, goes_on) = (tick.status & BUSY != 0, path.repeats || number < path.ticks);
            if is_busy != goes_on {
                let (coverage, status) = (errors.coverage(), tick.status);
                let ended = if goes_on {
                    RunError::EndedEarly { coverage, status }
                } else {
                    RunError::NotEnded { coverage, status }
                };
                return Err(ended);
            }
        }
        Ok(PlatformRun { errors, samples, trace: bench.into_trace(), status: seen, arming })
    }

    /// A bench with the controller at its bias pose, settled, in contact; and the time to reach it, s.
    pub(in crate::platform) fn ready<'a>(
        &'a mut self,
        controller: &'a mut dyn TickController,
        options: &RunOptions,
    ) -> Result<(Bench<'a>, f64), RunError> {
        let mut bench = Bench::new(self, controller, options.interval, options.latency)?;
        if options.record == Record::Trace {
            bench.record();
        }
        let arming = bench.arm(options.arming)?;
        if options.settle >= options.interval {
            for _ in 0..ticks_within(options.settle, options.interval)? {
                bench.tick(&Request::default())?;
            }
        }
        if let Some(part) = options.part {
            bench.rig().plant_mut().touch(part);
        }
        Ok((bench, arming))
    }
}

impl PlatformRun {
    /// Whether the controller followed every set-point: none was refused or stale.
    pub fn is_followed(&self) -> bool {
        self.status & NOT_FOLLOWED == 0
    }

    /// The errors, if they cover the path.
    ///
    /// # Errors
    /// If the controller held instead of following.
    pub fn scored(&self) -> Result<&PoseErrors, RunError> {
        if self.is_followed() {
            return Ok(&self.errors);
        }
        Err(RunError::EndedEarly { coverage: self.errors.coverage(), status: self.status })
    }

    /// CSV, one line per stored tick: target, pose and error, the controller's measurement, outputs and status. SI
    /// units.
    pub fn to_csv(&self) -> String {
        let six = |stem: &str| (0..6).map(|k| format!(",{stem}[{k}]")).collect::<String>();
        let mut out = String::from("time_s");
        for stem in ["target", "pose", "error", "measured", "voltage"] {
            out.push_str(&six(stem));
        }
        out.push_str(",status,status_text\n");
        for PoseSample { time, target, tick } in &self.samples {
            // Writing to a String cannot fail, here and below.
            let _ = write!(out, "{time:.6}");
            let error: Six = std::array::from_fn(|k| target[k] - tick.pose[k]);
            out.extend(
                [target, &tick.pose, &error, &tick.measured].into_iter().flatten().map(|value| format!(",{value:.4e}")),
            );
            out.extend(tick.voltage.iter().map(|value| format!(",{value:.4}")));
            let _ = writeln!(out, ",{},{}", tick.status, status_words(tick.status));
        }
        out
    }
}
