//! The command `learn`: options, the kept correction, and the report.

mod excite;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use host_sim::closed_loop::RunError;
use host_sim::platform::rig::Bench;
use host_sim::word::status_words;
use serde::Serialize;
use serde_json::Value;

use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::{check_input, check_place, write_file};
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_runtime::playback::Knot;

use crate::controllers::at_run_time;
use crate::factors::{Factors, UserRange};
use crate::learning::{
    Convergence, Ending, HystereticLegs, LearnError, Learnable, Learner, LearningResult, Motion, NOWHERE, Pass, Plan,
    RepeatableMachine, Response, Table, Update, knots, larger_limit, largest_correction, learn, pass_timing,
    takes_correction,
};
use crate::machine::{PlantOptions, run_failure};
use crate::trajectory::{self, NamedTrajectory};

/// Message if learning with a measured response converges nowhere.
const UNKNOWN: &str =
    "the measured response is too uncertain for learning; measure it along a longer motion with --excite";
/// Time limit for reaching the bias pose, s.
const ARMING: f64 = 60.0;
/// Measuring the response is recommended if the expected error is below this share of the error that was reached.
const WORTH_MEASURING: f64 = 0.8;

/// Options of `learn`.
#[derive(Debug)]
pub struct Options {
    /// Name of the motion.
    pub trajectory: Option<String>,
    /// Hz.
    pub frequency: Option<f64>,
    /// Number of passes to learn from.
    pub passes: u32,
    /// Highest frequency, Hz.
    pub bandwidth: f64,
    /// Ranges that replace those of the spec.
    pub vary: Vec<UserRange>,
    /// Start with a correction from the model.
    pub prepare: bool,
    /// Start with this correction.
    pub from: Option<PathBuf>,
    /// Measure the response into this file instead of learning.
    pub excite: Option<PathBuf>,
    /// File of a measured response to use.
    pub response: Option<PathBuf>,
    /// Knot capacity of the device, if it computes the corrections.
    pub on_device: Option<u32>,
    /// Output file of the correction.
    pub output: Option<PathBuf>,
    /// Name of a machine on a link.
    pub machine: Option<String>,
    /// The simulated machine.
    pub plant: PlantOptions,
}

impl Options {
    /// Refuses unreadable or unwritable files before a long run.
    ///
    /// # Errors
    /// A file cannot be read or written.
    pub fn check(&self) -> Result<(), Failure> {
        self.plant.leg()?;
        [&self.from, &self.response].into_iter().flatten().try_for_each(|path| check_input(path))?;
        [&self.output, &self.excite].into_iter().flatten().try_for_each(|path| check_place(path))
    }
}

/// The method that computes the corrections.
enum Rule {
    Host(Box<Update>),
    Device(Plan),
}

/// Everything needed for learning.
struct Study {
    compiled: Compilation,
    convergence: Convergence,
    motion: Motion,
    rule: Rule,
    motion_name: String,
    machine_name: String,
    initial: Vec<Knot>,
    spacing: u32,
}

/// Learns on the simulated machine of a spec, and reports the result.
///
/// # Errors
/// The spec or an option is refused, a run fails, or a file cannot be written.
pub fn simulated(options: &Options, compiled: Compilation, ui: &mut Ui) -> Result<(), Failure> {
    run(options, compiled, &mut SimulatedMachine(&options.plant), ui)
}

/// Learns on a machine, and reports the result.
///
/// # Errors
/// As [`simulated`], or the machine stops early.
pub fn run(
    options: &Options,
    compiled: Compilation,
    source: &mut impl MachineSource,
    ui: &mut Ui,
) -> Result<(), Failure> {
    if let Some(path) = &options.excite {
        return excite::run(options, path, &compiled, source, ui);
    }
    let study = study(options, source, compiled)?;
    let start = source.start().unwrap_or(study.motion.targets[0].pose);
    let SessionResult { result, reason, final_state } = source.work(
        &study.compiled,
        ui,
        |machine, ui| passes(options, &study, machine, ui),
        |learned, ui| keep(options, &study, learned, start, ui),
    )?;
    match (result, reason) {
        (Some(lesson), Some(reason)) => ui.judged(&lesson, Some(reason)),
        (None, Some(reason)) => Err(Failure::Gate(reason)),
        (Some(lesson), None) if !matches!(lesson.learned.ending, Ending::Interruption | Ending::Machine) => {
            ui.result(&lesson);
            Ok(())
        }
        (Some(lesson), None) => {
            let message = format!("interrupted; the best correction so far is kept{final_state}");
            Err(Failure::Interrupted { message, result: ui.shown(&lesson) })
        }
        (None, None) => Err(Failure::Gate(format!("interrupted during the first pass{final_state}"))),
    }
}

/// Result of a session on a machine.
pub struct SessionResult<F> {
    /// The result of the work, if the machine completed its passes.
    pub result: Option<F>,
    /// Why the session ended early, if it did.
    pub reason: Option<String>,
    /// The final state of a machine on a link, after "; ".
    pub final_state: String,
}

/// A machine for passes: simulated, or on a link.
pub trait MachineSource {
    /// Name of a motion on this machine.
    fn motion_name(&self, followed: &NamedTrajectory) -> String;

    /// Start pose of a motion stored on the machine, in the user's coordinates, m and rad.
    fn start(&self) -> Option<[f64; 6]>;

    /// Does work on the machine, and returns its result however the session ends.
    ///
    /// # Errors
    /// The machine cannot be reached, or the work fails.
    fn work<T, F>(
        &mut self,
        compiled: &Compilation,
        ui: &mut Ui,
        work: impl FnOnce(&mut dyn RepeatableMachine, &Ui) -> Result<T, LearnError>,
        keep: impl FnOnce(T, &Ui) -> Result<F, Failure>,
    ) -> Result<SessionResult<F>, Failure>;
}

/// The simulated machine of the spec.
struct SimulatedMachine<'a>(&'a PlantOptions);

impl MachineSource for SimulatedMachine<'_> {
    fn motion_name(&self, followed: &NamedTrajectory) -> String {
        format!("{} at {} Hz", followed.name, followed.frequency)
    }

    fn start(&self) -> Option<[f64; 6]> {
        None
    }

    fn work<T, F>(
        &mut self,
        compiled: &Compilation,
        ui: &mut Ui,
        work: impl FnOnce(&mut dyn RepeatableMachine, &Ui) -> Result<T, LearnError>,
        keep: impl FnOnce(T, &Ui) -> Result<F, Failure>,
    ) -> Result<SessionResult<F>, Failure> {
        let (model, task) = (&compiled.model, takes_correction(compiled)?);
        let mut controller = at_run_time(compiled, ui)?;
        let mut rig = self.0.platform(model, task)?.1.rig().clone();
        let mut bench = Bench::new(&mut rig, &mut controller, model.timing.period, 0).map_err(run_failure)?;
        bench.arm(ARMING).map_err(gate)?;
        let result = match work(&mut bench, ui) {
            Ok(done) => Some(keep(done, ui)?),
            Err(LearnError::PassEnded) => None,
            Err(error) => return Err(gate(error)),
        };
        Ok(SessionResult { result, reason: None, final_state: String::new() })
    }
}

/// The motion and its name.
fn motion_of(
    options: &Options,
    source: &impl MachineSource,
    compiled: &Compilation,
) -> Result<(Motion, String), Failure> {
    let model = &compiled.model;
    let task = takes_correction(compiled)?;
    let followed = trajectory::chosen(options.trajectory.as_deref(), options.frequency, options.plant.seed, compiled)?;
    let name = source.motion_name(&followed);
    let trajectory = followed.choice.of_platform(model, task);
    let speed = task.setpoint.speed;
    let motion =
        Motion::of(trajectory.as_ref(), model.timing.period, &speed, model.geometry.joint_radius()).map_err(gate)?;
    Ok((motion, name))
}

/// The name of the machine.
fn machine_name(options: &Options) -> String {
    let PlantOptions { plant, seed, .. } = &options.plant;
    let shape = plant.as_ref().map_or_else(|| "plays".to_owned(), |path| path.display().to_string());
    options.machine.clone().unwrap_or_else(|| format!("simulated, {shape}, seed {seed}"))
}

fn learnable_of(compiled: &Compilation) -> Result<Learnable, Failure> {
    Learnable::of(compiled)
        .ok_or_else(|| Failure::Environment("the platform has no modes, although the spec was checked".to_owned()))
}

fn study(options: &Options, source: &impl MachineSource, compiled: Compilation) -> Result<Study, Failure> {
    let (motion, motion_name) = motion_of(options, source, &compiled)?;
    let machine_name = machine_name(options);
    let mut learnable = learnable_of(&compiled)?;
    let mut refused = format!("{NOWHERE}, or measure the machine's response with --excite");
    if let Some(path) = &options.response {
        let named = |error| Failure::Gate(format!("{}: {error}", path.display()));
        let response = Response::of_file(path).map_err(named)?;
        response.is_for(&compiled.ir.digest, &machine_name).map_err(named)?;
        learnable = learnable.with(response);
        refused = UNKNOWN.to_owned();
    }
    let factors = Factors::of(&compiled.model, &options.vary);
    let convergence = learnable.convergence(&factors, options.bandwidth).ok_or(Failure::Gate(refused))?;
    let plan = options.on_device.map(|room| {
        Plan::new(&learnable, &motion, &convergence, &factors, room as usize).ok_or_else(|| {
            Failure::Gate(format!(
                "no plan for this motion fits into {room} knots and converges on every machine within the declared intervals; omit \
                 --on-device or use a shorter motion"
            ))
        })
    });
    let plan = plan.transpose()?;
    let convergence = plan.as_ref().map_or(convergence, |plan| plan.convergence.clone());
    let (initial, spacing) =
        initial_correction(options, &compiled, &learnable, &motion, &convergence, [&machine_name, &motion_name])?;
    let rule = plan
        .map_or_else(|| Rule::Host(Box::new(Update::new(&learnable, &motion, &convergence, spacing))), Rule::Device);
    Ok(Study { compiled, convergence, motion, rule, motion_name, machine_name, initial, spacing })
}

/// Runs the passes, reporting each; the user may stop them.
fn passes(
    options: &Options,
    study: &Study,
    machine: &mut dyn RepeatableMachine,
    ui: &Ui,
) -> Result<LearningResult, LearnError> {
    let Study { motion, rule, initial, spacing, .. } = study;
    let learner = match rule {
        Rule::Host(update) => Learner::Host(update),
        Rule::Device(plan) => Learner::Device(plan),
    };
    let stop = interrupt::heed();
    let count = options.passes as usize;
    let learned = learn(machine, motion, learner, initial, *spacing, count, |number, pass| {
        ui.rate(&format!("learn: pass {number} of {count}, {:.1} nm", pass.translation_nm));
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    ui.rate_done();
    learned
}

/// Writes the table of the best pass to the output file, if one is given.
fn keep(
    options: &Options,
    study: &Study,
    learned: LearningResult,
    start: [f64; 6],
    ui: &Ui,
) -> Result<Lesson, Failure> {
    let Study { compiled, convergence, motion, motion_name, machine_name, spacing, .. } = study;
    if let Some(path) = &options.output {
        let names = [compiled.ir.digest.as_str(), machine_name, motion_name];
        let mut knots = learned.knots.clone();
        // Nothing was learned and nothing given: write a correction of zeros, which has no effect.
        knots.resize(pass_timing(motion, *spacing, 0).knots() as usize, [0; 6]);
        let zeros = if knots.iter().all(|knot| *knot == [0; 6]) { ", all zero," } else { "" };
        let table = Table::new(names, [*spacing, motion.scored.start as u32], start, knots);
        write_file(path, table.to_json().as_bytes())?;
        ui.progress(&format!("wrote {} knots{zeros} to {}", table.knots.len(), path.display()));
    }
    Ok(Lesson {
        name: compiled.ir.name.clone(),
        motion: motion_name.clone(),
        machine: machine_name.clone(),
        convergence: convergence.clone(),
        help: help(options, study, &learned),
        learned,
    })
}

/// What would improve the result: a larger limit, the machine's own response, or damping.
fn help(options: &Options, study: &Study, learned: &LearningResult) -> Vec<String> {
    let Study { compiled, convergence, .. } = study;
    let [_, highest] = convergence.band;
    let task = compiled.model.task_space.as_ref();
    let mut help = Vec::new();
    if let Some((sufficient, limit)) = learned.sufficient_nm.zip(task.and_then(|task| task.correction)) {
        help.push(larger_limit([sufficient * 1e-9, limit, largest_correction(&compiled.model)]));
    }
    // The device cannot use a measured response, and its capacity may be the limit.
    if options.on_device.is_some() {
        return help;
    }
    if !task.is_some_and(|task| task.active_damping) && highest < options.bandwidth {
        help.push(format!("to learn above {highest:.0} Hz, damp the modes: `control.active_damping = true`"));
    }
    let left = learned.passes[learned.best].measured_nm;
    let stopped = matches!(learned.ending, Ending::Growth | Ending::NoGain);
    let expected = learned.expected_nm.filter(|expected| *expected < WORTH_MEASURING * left);
    let reach = convergence.reach();
    if let Some(expected) = expected.filter(|_| !convergence.measured && (stopped || highest < reach)) {
        let wider = if reach > options.bandwidth { format!(" --bandwidth {reach}") } else { String::new() };
        help.push(format!(
            "measure the response with --excite FILE{wider}, then learn with --response FILE{wider}: about {expected:.1} nm by the gauges \
             instead of {left:.1}"
        ));
    }
    help
}

fn gate(error: impl Into<LearnError>) -> Failure {
    let error = error.into();
    failure(&error, error.to_string())
}

/// The failure of a command whose motion was not completed.
pub fn failure(error: &LearnError, message: String) -> Failure {
    match error {
        LearnError::Run(RunError::EndedEarly { .. }) | LearnError::Status(_) => {
            Failure::EndedEarly { message, result: Value::Null }
        }
        _ => Failure::Gate(message),
    }
}

/// The initial correction, and the ticks between knots.
fn initial_correction(
    options: &Options,
    compiled: &Compilation,
    learnable: &Learnable,
    motion: &Motion,
    convergence: &Convergence,
    [machine, motion_name]: [&str; 2],
) -> Result<(Vec<Knot>, u32), Failure> {
    let period = compiled.model.timing.period;
    let spacing = convergence.spacing(period);
    if options.prepare {
        let legs = HystereticLegs::of(compiled, learnable, motion).map_err(environment)?;
        let prepared = Update::prepared(learnable, motion, convergence.band[1], legs.as_ref());
        return Ok((knots(&prepared, spacing), spacing));
    }
    let Some(path) = &options.from else { return Ok((Vec::new(), spacing)) };
    let table = Table::of_file(path).map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))?;
    table
        .is_for(&compiled.ir.digest, machine, motion_name)
        .map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))?;
    Ok((table.knots, table.spacing))
}

/// Why learning ended, and which correction is kept.
fn kept(learned: &LearningResult) -> Vec<String> {
    // Without passes to learn from there is nothing to report.
    let Some(noise) = learned.noise_nm else { return Vec::new() };
    let last = learned.passes.len() - 1;
    let why = match learned.ending {
        Ending::NoGain => Some(format!("learning stopped: pass {last} brought no improvement")),
        Ending::Growth => Some(format!("learning stopped: the error grew in pass {last}")),
        Ending::AllPasses | Ending::Interruption | Ending::Machine => None,
    };
    let which = match learned.best {
        0 => "kept: the initial correction (pass 0)".to_owned(),
        best => format!("kept: the correction of pass {best}"),
    };
    let noise = format!("repeatability without learning {noise:.2} nm by the gauges; an improvement must exceed this");
    why.into_iter().chain([which, noise]).collect()
}

/// Report of `learn`.
#[derive(Serialize)]
struct Lesson {
    name: String,
    motion: String,
    machine: String,
    convergence: Convergence,
    #[serde(flatten)]
    learned: LearningResult,
    /// What would improve the result.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    help: Vec<String>,
}

impl Outcome for Lesson {
    fn text(&self) -> String {
        let Self { name, motion, machine, convergence, learned, help } = self;
        let [low, high] = convergence.band;
        let (first, best) = (&learned.passes[0], &learned.passes[learned.best]);
        let gained = match learned.best {
            0 => format!("{:.1} nm rms", first.translation_nm),
            1 => format!("{:.1} -> {:.1} nm rms in 1 pass", first.translation_nm, best.translation_nm),
            many => format!("{:.1} -> {:.1} nm rms in {many} passes", first.translation_nm, best.translation_nm),
        };
        let mut text = format!("{name}: {motion}, {gained} ({machine})\n");
        text.push_str(&format!("  each pass measured over {}\n", best.coverage));
        text += &format!(
            "  learned {low:.1} to {high:.0} Hz; each pass multiplies the error by at most {:.2} {}, worst at {:.0} Hz\n",
            convergence.radius,
            if convergence.measured {
                "for the\n  measured response"
            } else {
                "on every machine within\n  the intervals"
            },
            convergence.at
        );
        let columns = [right(6), right(10), right(10), right(12), left(0).behind("  ")];
        row(&mut text, &columns, &[&"pass", &"nm rms", &"nrad rms", &"gauges, nm", &""]);
        for (number, pass) in learned.passes.iter().enumerate() {
            let Pass { translation_nm, orientation_nrad, measured_nm, status, .. } = pass;
            let notes = [if number == learned.best { "kept" } else { "" }.to_owned(), status_words(*status)];
            let notes: Vec<String> = notes.into_iter().filter(|text| !text.is_empty()).collect();
            let [translation, gauges] = [translation_nm, measured_nm].map(|nm| format!("{nm:.1}"));
            let orientation = format!("{orientation_nrad:.0}");
            row(&mut text, &columns, &[&number, &translation, &orientation, &gauges, &notes.join(", ")]);
        }
        text.extend(kept(learned).into_iter().map(|line| format!("  {line}\n")));
        text.extend(help.iter().map(|help| format!("help: {help}\n")));
        text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }
}
