//! Runs of processor-in-the-loop: the scenarios of `sim`, with a lock-step as controller.

use std::path::Path;
use std::time::Instant;

use host_sim::closed_loop::{Rig, RunError, Tracking};
use host_sim::platform::rig::{OnBoard, PlatformRun};
use host_sim::platform::scenario::{FREE_MODES, select as select_platform};
use host_sim::platform::table::{MachiningTable, PoseRow};
use host_sim::platform::{PlatformScenario, WorkPart};
use host_sim::scenario::{MODES, select as select_legs};
use host_sim::table::TrackingRow;
use host_sim::trajectory::{LegTrajectory, PaperLeg, PaperPath, PaperPose, PoseTarget, PoseTrajectory, Reading};
use specgen_link::client::Port;

use super::lockstep::Lockstep;
use super::report::Report;
use specgen_compiler::compile::Compilation;
use specgen_language::model::TaskSpace;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_runtime::ControlMode;
use specgen_studies::machine::PlantOptions;
use specgen_studies::{machine, runs};

/// Default operating frequency, Hz.
const FREQUENCY: f64 = 10.0;
/// Default operating frequency against a work part, Hz.
const MACHINING_FREQUENCY: f64 = 1.0;
/// Default number of control ticks per period of the leg trajectory.
const SAMPLES: u32 = 500;

/// Options of the runs.
#[derive(Debug)]
pub struct Options<'a> {
    /// Workspace to build in.
    pub output: Option<&'a Path>,
    /// A scenario of the paper.
    pub scenario: Option<&'a str>,
    /// A trajectory of the spec.
    pub trajectory: Option<&'a str>,
    /// One control mode only.
    pub mode: Option<&'a str>,
    /// Operating frequency, Hz.
    pub frequency: Option<f64>,
    /// Control ticks per period of the leg trajectory.
    pub samples: Option<u32>,
    /// Run only this much of the trajectory, s.
    pub seconds: Option<f64>,
    /// The simulated machine.
    pub plant: PlantOptions,
    /// A board at this serial port, at this rate in baud; QEMU without one.
    pub port: Option<(&'a Path, u32)>,
    /// An existing image.
    pub elf: Option<&'a Path>,
}

/// A completed run, to plot its errors.
pub enum Run<'a> {
    /// Of six legs.
    Legs {
        /// Its title.
        title: &'a str,
        /// Errors over time.
        tracking: &'a Tracking,
    },
    /// Of a platform.
    Platform {
        /// Its title.
        title: &'a str,
        /// Control interval, s.
        interval: f64,
        /// The run.
        run: &'a PlatformRun,
    },
}

/// Errors of a plan.
pub(super) enum PlanError {
    Command(Failure),
    /// The error of a run; the lock-step may have a better reason.
    Run(RunError),
}

impl From<RunError> for PlanError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl From<Failure> for PlanError {
    fn from(failure: Failure) -> Self {
        Self::Command(failure)
    }
}

/// Runs `run` and adds its duration to `seconds`.
fn timed<T>(seconds: &mut f64, run: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let done = run();
    *seconds += start.elapsed().as_secs_f64();
    done
}

/// The runs of one command.
pub(super) enum Plan {
    Legs {
        /// Names with the values of the `mode` word.
        modes: Vec<(&'static str, u32)>,
        frequency: f64,
        samples: u32,
    },
    /// A streamed path of the paper.
    Path {
        name: &'static str,
        path: PaperPath,
        part: Option<WorkPart>,
        modes: Vec<(&'static str, u32)>,
        frequency: f64,
    },
    /// A trajectory generated on the device.
    Board { name: String, path: OnBoard, mode: Option<(&'static str, u32)> },
}

impl Plan {
    /// The plan of the options.
    ///
    /// # Errors
    /// The options do not apply to the spec.
    pub fn of(options: &Options<'_>, compiled: &Compilation) -> Result<Self, Failure> {
        match &compiled.model.task_space {
            Some(task) => Self::platform(options, compiled, task),
            None => Self::legs(options, compiled),
        }
    }

    fn legs(options: &Options<'_>, compiled: &Compilation) -> Result<Self, Failure> {
        if options.scenario.is_some() || options.trajectory.is_some() {
            return Err(Failure::Usage(
                "--scenario and --trajectory need a spec with [control]; without it, the leg trajectory is the only scenario"
                    .to_owned(),
            ));
        }
        let modes = match options.mode {
            Some(name) => vec![mode(name, &MODES)?],
            None => runs::modes(&compiled.model.adaptation),
        };
        let frequency = options.frequency.unwrap_or(FREQUENCY);
        let samples = options.samples.unwrap_or(SAMPLES);
        runs::judge(compiled, frequency, samples)?;
        Ok(Self::Legs { modes, frequency, samples })
    }

    fn platform(options: &Options<'_>, compiled: &Compilation, task: &TaskSpace) -> Result<Self, Failure> {
        if options.samples.is_some() {
            return Err(Failure::Usage(
                "--samples is for legs with their own gauges; a spec with [control] runs at its timing.period"
                    .to_owned(),
            ));
        }
        let wanted = options.mode.map(|name| mode(name, &ControlMode::WORDS)).transpose()?;
        if let Some(name) = options.trajectory {
            if options.frequency.is_some() {
                return Err(Failure::Usage(
                    "--frequency is for the paper's cases; the spec gives the frequency of its own trajectories"
                        .to_owned(),
                ));
            }
            let path = machine::on_board(compiled, runs::selector(task, name)?);
            let path = path.ok_or_else(|| Failure::Usage(format!("the controller has no trajectory `{name}`")))?;
            return Ok(Self::Board { name: name.to_owned(), path, mode: wanted });
        }
        let (name, path, part) = match options.scenario.unwrap_or("case-1") {
            "case-1" => ("case-1", PaperPath::Case1, None),
            "case-2" => ("case-2", PaperPath::Case2, None),
            "glass" => ("glass", PaperPath::Machining, Some(WorkPart::glass())),
            "aluminium" => ("aluminium", PaperPath::Machining, Some(WorkPart::aluminium())),
            other => {
                return Err(Failure::Usage(format!(
                    "there is no scenario `{other}`; expected case-1, case-2, glass or aluminium, or --trajectory with one of the spec's own"
                )));
            }
        };
        let usual = match part {
            None => FREE_MODES.to_vec(),
            Some(_) => vec![ControlMode::WORDS[0], ControlMode::WORDS[3], ControlMode::WORDS[6]],
        };
        let frequency = options.frequency.unwrap_or(if part.is_some() { MACHINING_FREQUENCY } else { FREQUENCY });
        Ok(Self::Path { name, path, part, modes: wanted.map_or(usual, |mode| vec![mode]), frequency })
    }

    /// Runs the plan, and writes the results to the report.
    pub fn run<P: Port>(
        &self,
        lockstep: &mut Lockstep<P>,
        report: &mut Report,
        compiled: &Compilation,
        options: &Options<'_>,
        draw: &mut dyn FnMut(Run<'_>),
        ui: &Ui,
    ) -> Result<(), PlanError> {
        match self {
            Self::Legs { modes, frequency, samples } => {
                let rig = legs(compiled, *samples, options, ui)?;
                let trajectory = Start::of(PaperLeg { frequency: *frequency }, options.seconds);
                let interval = 1.0 / frequency / f64::from(*samples);
                report.interval = interval;
                for &(mode, word) in modes {
                    ui.progress(&format!("leg trajectory at {frequency} Hz, {mode}"));
                    select_legs(lockstep, word).map_err(RunError::from)?;
                    let mut rig = rig.clone();
                    let run = timed(&mut report.seconds, || rig.run(lockstep, &trajectory, interval))?;
                    draw(Run::Legs { title: &format!("{mode} at {frequency} Hz"), tracking: &run.tracking });
                    report.tracking.rows.push(TrackingRow::of(mode, *frequency, &run.tracking));
                }
                report.errors = format!("tracking error of the leg trajectory, T − Y\n{}", report.tracking.to_text());
                Ok(())
            }
            Self::Path { name, path, part, modes, frequency } => {
                let trajectory = PaperPose { path: *path, reading: Reading::Corrected, frequency: *frequency };
                let trajectory = Start::of(trajectory, options.seconds);
                let scenario = platform(compiled, options, ui)?;
                let mut machining = MachiningTable::default();
                for &(mode, word) in modes {
                    ui.progress(&format!("{name} at {frequency} Hz, {mode}"));
                    select_platform(lockstep, word).map_err(RunError::from)?;
                    let run = timed(&mut report.seconds, || match part {
                        None => scenario.run(lockstep, &trajectory),
                        Some(part) => scenario.against(lockstep, &trajectory, *part),
                    })?;
                    let title = format!("{name} at {frequency} Hz, {mode}");
                    draw(Run::Platform { title: &title, interval: scenario.options.interval, run: &run });
                    match (run.scored(), part) {
                        (Err(error), _) => report.ended(&title, &error),
                        (Ok(found), None) => report.free_motion.rows.push(PoseRow::of(name, mode, *frequency, found)),
                        (Ok(found), Some(_)) => machining.push(name, mode, found),
                    }
                }
                if part.is_none() {
                    report.write_free_motion();
                } else {
                    report.write_machining(&machining);
                }
                Ok(())
            }
            Self::Board { name, path, mode } => {
                let scenario = platform(compiled, options, ui)?;
                if let Some((_, word)) = mode {
                    select_platform(lockstep, *word).map_err(RunError::from)?;
                }
                ui.progress(&format!("playing {name} on board"));
                let run = timed(&mut report.seconds, || scenario.play(lockstep, path, options.seconds))?;
                draw(Run::Platform { title: name, interval: scenario.options.interval, run: &run });
                match run.scored() {
                    Ok(errors) => {
                        let played = runs::TrajectoryErrors::of(name, errors);
                        report.errors = played.text();
                        report.on_board = Some(played);
                    }
                    Err(error) => report.ended(name, &error),
                }
                Ok(())
            }
        }
    }
}

fn mode(name: &str, known: &[(&'static str, u32)]) -> Result<(&'static str, u32), Failure> {
    known.iter().find(|(known, _)| *known == name).copied().ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        Failure::Usage(format!("there is no mode `{name}` for this spec; expected one of {}", names.join(", ")))
    })
}

/// Six legs at rest, with their gauges zeroed.
fn legs(compiled: &Compilation, samples: u32, options: &Options<'_>, ui: &Ui) -> Result<Rig, PlanError> {
    let (parameters, noise) = options.plant.read()?;
    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs = std::array::from_fn(|_| parameters.clone());
    let mut scenario = machine::legs(&compiled.model, &legs, &noise, options.plant.seed, samples);
    Ok(scenario.rig_mut().clone())
}

fn platform(compiled: &Compilation, options: &Options<'_>, ui: &Ui) -> Result<PlatformScenario, PlanError> {
    let model = &compiled.model;
    // Only a spec with a platform leads here.
    let Some(task) = &model.task_space else {
        return Err(Failure::Usage("this spec has no [control]".to_owned()).into());
    };
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    Ok(options.plant.platform(model, task)?.1)
}

/// The start of a trajectory, or all of it.
struct Start<T> {
    whole: T,
    seconds: f64,
}

impl<T> Start<T> {
    fn of(whole: T, seconds: Option<f64>) -> Self {
        Self { whole, seconds: seconds.unwrap_or(f64::INFINITY) }
    }

    fn cut(&self, duration: f64) -> f64 {
        if self.seconds < duration { self.seconds } else { duration }
    }
}

impl<T: LegTrajectory> LegTrajectory for Start<T> {
    fn duration(&self) -> f64 {
        self.cut(self.whole.duration())
    }

    fn whole(&self) -> f64 {
        self.whole.duration()
    }

    fn displacements(&self, time: f64) -> [f64; 6] {
        self.whole.displacements(time)
    }
}

impl<T: PoseTrajectory> PoseTrajectory for Start<T> {
    fn duration(&self) -> f64 {
        self.cut(self.whole.duration())
    }

    fn whole(&self) -> f64 {
        self.whole.duration()
    }

    fn target(&self, time: f64) -> PoseTarget {
        self.whole.target(time)
    }
}
