//! `specgen learn`: a motion that repeats, learned between passes, on the simulated machine of a spec or over the link on a real one.

mod excite;
mod machine;

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use clap::Args;
use host_sim::closed_loop::RunError;
use host_sim::platform::rig::{Bench, Noise};
use host_sim::word::status_words;
use serde::Serialize;
use serde_json::Value;

use super::line::Line;
use super::named::{InputFile, OutputFile};
use super::operate::{Ended, Operator, motion_name};
use super::sim::{PlantArguments, at_run_time, frequency};
use super::spec;
use super::trajectory;
use machine::{Own, Remote};
use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::model::TaskSpace;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{check_input, check_place, write_file};
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_report::learning::BANDWIDTH;
use specgen_runtime::playback::Knot;
use specgen_studies::learning::{
    Convergence, Ending, LearnError, Learnable, Learner, LearningResult, Motion, Pass, Plan, RepeatableMachine,
    Response, Table, Update, course, knots, learn,
};
use specgen_studies::machine as plant;
use specgen_studies::machine::run_failure;
use specgen_studies::robust::Factors;
use specgen_studies::robust::factors::UserRange;

/// Why nothing is learned with the model's response.
pub(super) const NOWHERE: &str = "learning converges at no frequency on every machine within the declared intervals; narrow them in [robust] or by \
     --vary, such as stiffness=2%, once they are measured";
/// The same with a measured one.
const UNKNOWN: &str =
    "too little is known of the measured response for learning; measure it along a longer motion by --excite";
/// How long the machine may take to its bias pose, s.
const ARMING: f64 = 60.0;

/// Arguments of `learn`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LEARN)]
pub struct Arguments {
    /// The spec file, with `control.correction`.
    spec: InputFile,
    /// What is learned: case-1, case-2, machining or multisine, or a trajectory of the spec by its name; case-1 if not given. A machine
    /// at the end of a link learns the trajectories that it has.
    #[arg(long, value_name = "NAME")]
    trajectory: Option<String>,
    /// Its operating frequency, Hz; 10, or that of the spec, if not given.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Passes that are learned from at most; one more shows what came of them. The first that gains no more than its noise ends learning.
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=1000))]
    passes: u32,
    /// Highest frequency to be learned, Hz; lowered to where every machine within [robust] converges.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true, default_value_t = BANDWIDTH)]
    bandwidth: f64,
    /// Range of an uncertainty, in place of that of [robust] or the default: `stiffness=2%`, `gain=0.9:1.1`, `delay_ticks=0`.
    #[arg(long, value_name = "NAME=RANGE", value_parser = UserRange::parse)]
    vary: Vec<UserRange>,
    /// Begin with what the model says lag and modes would leave.
    #[arg(long, conflicts_with = "from")]
    prepare: bool,
    /// Begin with this correction, of the same spec, machine and motion.
    #[arg(long, value_name = "FILE")]
    from: Option<InputFile>,
    /// Learn nothing: measure the response of the running loop to a correction, by sweeps within passes of the motion, and write it here (JSON).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["passes", "vary", "prepare", "from", "output", "response"])]
    excite: Option<OutputFile>,
    /// Learn with the response that --excite measured on this machine, not with the model's and the intervals of [robust].
    #[arg(long, value_name = "FILE", conflicts_with = "vary")]
    response: Option<InputFile>,
    /// Let the machine's own device make each correction, in its background, in room for so many knots a pass: 4096 on an STM32H743, which is
    /// taken if no number is given, 768 on an STM32F446, 65536 on a PC.
    #[arg(long, value_name = "KNOTS", num_args = 0..=1, default_missing_value = "4096", conflicts_with_all = ["excite", "response"],
          value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    on_device: Option<u32>,
    /// Write the correction that is kept here (JSON): that of the last pass that gained more than its noise.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
    /// Learn on this machine, which is armed for it and ramped down after it.
    #[command(flatten)]
    line: Line,
    /// What the machine at the end of the link is called; a correction is played on no other.
    #[arg(long, value_name = "NAME")]
    machine: Option<String>,
    #[command(flatten)]
    plant: PlantArguments,
}

/// Who makes the corrections, and by what.
enum Rule {
    Host(Box<Update>),
    Device(Plan),
}

/// What is learned, and how.
struct Study {
    compiled: Compilation,
    convergence: Convergence,
    motion: Motion,
    rule: Rule,
    motion_name: String,
    machine_name: String,
    begin: Vec<Knot>,
    spacing: u32,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let named = arguments.line.is_named();
    if named != arguments.machine.is_some() {
        let missing = if named { "--machine NAME: a correction is played on no other" } else { "--port or --socket" };
        return Err(Failure::Usage(format!("learning on a machine also needs {missing}")));
    }
    if named && (arguments.plant.plant.is_some() || arguments.plant.no_noise || arguments.frequency.is_some()) {
        let text = "--plant, --no-noise and --frequency are for the simulated machine; a real one is as it is, and plays the \
                    trajectories of its spec";
        return Err(Failure::Usage(text.to_owned()));
    }
    arguments.plant.leg()?;
    [&arguments.from, &arguments.response].into_iter().flatten().try_for_each(|path| check_input(path))?;
    arguments.output.as_deref().map_or(Ok(()), check_place)?;
    arguments.excite.as_deref().map_or(Ok(()), check_place)?;
    let compiled = if named { spec::looked_up(&arguments.spec, ui)? } else { spec::compiled(&arguments.spec, ui)? };
    let own = if named { Some(Own::named(arguments.trajectory.as_deref(), &compiled)?) } else { None };
    if let Some(path) = &arguments.excite {
        return excite::run(arguments, path, &compiled, own.as_ref(), ui);
    }
    let study = study(arguments, compiled)?;
    let start = own.as_ref().map_or(study.motion.targets[0].pose, |own| own.start);
    let Done { found, why, down } = on(
        arguments,
        &study.compiled,
        own.as_ref(),
        ui,
        |machine, ui| passes(arguments, &study, machine, ui),
        |learned, ui| keep(arguments, &study, learned, start, ui),
    )?;
    match (found, why) {
        (Some(found), Some(why)) => ui.judged(&found, Some(why)),
        (None, Some(why)) => Err(Failure::Gate(why)),
        (Some(found), None) if !matches!(found.learned.ending, Ending::Interruption | Ending::Machine) => {
            ui.result(&found);
            Ok(())
        }
        (Some(found), None) => {
            let message = format!("interrupted: what was learned so far is kept{down}");
            Err(Failure::Interrupted { message, result: ui.shown(&found) })
        }
        (None, None) => Err(Failure::Gate(format!("interrupted before the first pass was over{down}"))),
    }
}

/// What came of work on a machine.
struct Done<F> {
    /// What was found, if the machine made its passes.
    found: Option<F>,
    /// Why it ended before it was asked to.
    why: Option<String>,
    /// How a machine at the end of a link was left, behind "; ".
    down: String,
}

/// Does work on the machine at the end of the link, or on a simulated one, and keeps what it gives, however the machine ends.
fn on<T, F>(
    arguments: &Arguments,
    compiled: &Compilation,
    own: Option<&Own>,
    ui: &mut Ui,
    work: impl FnOnce(&mut dyn RepeatableMachine, &Ui) -> Result<T, LearnError>,
    keep: impl FnOnce(T, &Ui) -> Result<F, Failure>,
) -> Result<Done<F>, Failure> {
    match own {
        Some(own) => on_machine(arguments, compiled, own, ui, work, keep),
        None => simulated(arguments, compiled, ui, work, keep),
    }
}

/// The motion, and what it is called.
fn motion_of(arguments: &Arguments, compiled: &Compilation) -> Result<(Motion, String), Failure> {
    let model = &compiled.model;
    let task = takes_correction(compiled)?;
    let followed =
        trajectory::chosen(arguments.trajectory.as_deref(), arguments.frequency, arguments.plant.seed, compiled)?;
    let name = match &arguments.machine {
        Some(_) => motion_name(&followed.name),
        None => format!("{} at {} Hz", followed.name, followed.frequency),
    };
    let trajectory = followed.choice.of_platform(model, task);
    let speed = task.setpoint.speed;
    let motion =
        Motion::of(trajectory.as_ref(), model.timing.period, &speed, model.geometry.joint_radius()).map_err(gate)?;
    Ok((motion, name))
}

/// What the machine is called.
fn machine_name(arguments: &Arguments) -> String {
    let PlantArguments { plant, seed, .. } = &arguments.plant;
    let shape = plant.as_ref().map_or_else(|| "plays".to_owned(), |path| path.display().to_string());
    arguments.machine.clone().unwrap_or_else(|| format!("simulated, {shape}, seed {seed}"))
}

fn learnable_of(compiled: &Compilation) -> Result<Learnable, Failure> {
    Learnable::of(compiled)
        .ok_or_else(|| Failure::Environment("the platform has no modes, which the spec was checked for".to_owned()))
}

fn study(arguments: &Arguments, compiled: Compilation) -> Result<Study, Failure> {
    let (motion, motion_name) = motion_of(arguments, &compiled)?;
    let machine_name = machine_name(arguments);
    let mut learnable = learnable_of(&compiled)?;
    let mut refused = format!("{NOWHERE}, or measure the response of the machine by --excite");
    if let Some(path) = &arguments.response {
        let named = |error| Failure::Gate(format!("{}: {error}", path.display()));
        let response = Response::of_file(path).map_err(named)?;
        response.is_for(&compiled.ir.digest, &machine_name).map_err(named)?;
        learnable = learnable.with(response);
        refused = UNKNOWN.to_owned();
    }
    let factors = Factors::of(&compiled.model, &arguments.vary);
    let convergence = learnable.convergence(&factors, arguments.bandwidth).ok_or(Failure::Gate(refused))?;
    let plan = arguments.on_device.map(|room| {
        Plan::new(&learnable, &motion, &convergence, &factors, room as usize).ok_or_else(|| {
            Failure::Gate(format!(
                "no plan of this motion fits into {room} knots and converges on every machine within the declared intervals; learn without \
                 --on-device, or a shorter motion"
            ))
        })
    });
    let plan = plan.transpose()?;
    let convergence = plan.as_ref().map_or(convergence, |plan| plan.convergence.clone());
    let (begin, spacing) =
        begin(arguments, &compiled, &learnable, &motion, &convergence, [&machine_name, &motion_name])?;
    let rule = plan
        .map_or_else(|| Rule::Host(Box::new(Update::new(&learnable, &motion, &convergence, spacing))), Rule::Device);
    Ok(Study { compiled, convergence, motion, rule, motion_name, machine_name, begin, spacing })
}

/// Makes the passes; the reader sees each, and may end them.
fn passes(
    arguments: &Arguments,
    study: &Study,
    machine: &mut dyn RepeatableMachine,
    ui: &Ui,
) -> Result<LearningResult, LearnError> {
    let Study { motion, rule, begin, spacing, .. } = study;
    let learner = match rule {
        Rule::Host(update) => Learner::Host(update),
        Rule::Device(plan) => Learner::Device(plan),
    };
    let stop = interrupt::heed();
    let count = arguments.passes as usize;
    let learned = learn(machine, motion, learner, begin, *spacing, count, |number, pass| {
        ui.rate(&format!("learn: pass {number} of {count}, {:.1} nm", pass.translation_nm));
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    ui.rate_done();
    learned
}

fn simulated<T, F>(
    arguments: &Arguments,
    compiled: &Compilation,
    ui: &mut Ui,
    work: impl FnOnce(&mut dyn RepeatableMachine, &Ui) -> Result<T, LearnError>,
    keep: impl FnOnce(T, &Ui) -> Result<F, Failure>,
) -> Result<Done<F>, Failure> {
    let (leg, seed) = (arguments.plant.leg()?, arguments.plant.seed);
    let (model, task) = (&compiled.model, takes_correction(compiled)?);
    let mut controller = at_run_time(compiled, ui)?;
    let specimen = plant::specimen(model, task, &leg, Some(seed));
    let noise = if arguments.plant.no_noise { Noise::NONE } else { Noise::of(&specimen) };
    let scenario = plant::scenario(model, task, &specimen, &noise, seed);
    let mut rig = scenario.rig().clone();
    let mut bench = Bench::new(&mut rig, &mut controller, model.timing.period, 0).map_err(run_failure)?;
    bench.arm(ARMING).map_err(gate)?;
    let found = match work(&mut bench, ui) {
        Ok(done) => Some(keep(done, ui)?),
        Err(LearnError::Ended) => None,
        Err(error) => return Err(gate(error)),
    };
    Ok(Done { found, why: None, down: String::new() })
}

fn on_machine<T, F>(
    arguments: &Arguments,
    compiled: &Compilation,
    own: &Own,
    ui: &mut Ui,
    work: impl FnOnce(&mut dyn RepeatableMachine, &Ui) -> Result<T, LearnError>,
    keep: impl FnOnce(T, &Ui) -> Result<F, Failure>,
) -> Result<Done<F>, Failure> {
    interrupt::heed();
    let ir = &compiled.ir;
    let (session, name) = arguments.line.open(Some(&ir.digest))?;
    let lost = |error: &dyn std::fmt::Display| {
        Failure::Environment(format!(
            "{name}: {error}; a machine that lost its host holds, then ramps down (supervisor.host_lost)"
        ))
    };
    let mut operator = Operator::new(session, interrupt::heed());
    if !operator.is_set_to(&ir.integrity.settings).map_err(|error| lost(&error))? {
        return Err(Failure::Gate(format!(
            "{name}: its settings are not those of the spec, for which learning is proven to converge; `config write {}` in \
             specgen operate restores them",
            arguments.spec.display()
        )));
    }
    let mut remote = Remote { operator: &mut operator, ui, own, has: None, ended: None };
    let done = match remote.arm() {
        Ok(()) => work(&mut remote, ui),
        Err(ended) => {
            remote.ended = Some(ended);
            Err(LearnError::Ended)
        }
    };
    let ended = remote.ended;
    let down = match &ended {
        Some(Ended::Link(error)) => Err(lost(error)),
        _ if operator.is_powered() => operator.ramp_down(ui).map_err(|error| lost(&error)),
        _ => Ok(format!("the machine is {}, amplifiers off", operator.stands())),
    };
    // What was found is kept, however the machine ended.
    let found = match done {
        Ok(done) => Some(keep(done, ui)?),
        Err(LearnError::Ended) => None,
        Err(error) => return Err(down.err().unwrap_or_else(|| failure(&error, format!("{name}: {error}")))),
    };
    let down = format!("; {}", down?);
    let why = match ended {
        Some(Ended::Refused(text) | Ended::Fault(text)) => Some(format!("{name}: {text}")),
        Some(Ended::Failed(failure)) => return Err(failure),
        Some(Ended::Stopped) => Some(format!("{name}: the program that serves the link has ended")),
        Some(Ended::Link(_) | Ended::Interrupted) | None => None,
    };
    Ok(Done { found, why, down })
}

/// Writes the table of the best pass, if a file is named.
fn keep(
    arguments: &Arguments,
    study: &Study,
    learned: LearningResult,
    start: [f64; 6],
    ui: &Ui,
) -> Result<Found, Failure> {
    let Study { compiled, convergence, motion, motion_name, machine_name, spacing, .. } = study;
    if let Some(path) = &arguments.output {
        let names = [compiled.ir.digest.as_str(), machine_name, motion_name];
        let mut knots = learned.knots.clone();
        // Nothing learned, from nothing: a correction of zeros, which plays as none.
        knots.resize(course(motion, *spacing, 0).knots() as usize, [0; 6]);
        let zeros = if knots.iter().all(|knot| *knot == [0; 6]) { ", all of them zero," } else { "" };
        let table = Table::new(names, [*spacing, motion.scored.start as u32], start, knots);
        write_file(path, table.to_json().as_bytes())?;
        ui.progress(&format!("wrote {} knots{zeros} to {}", table.knots.len(), path.display()));
    }
    Ok(Found {
        name: compiled.ir.name.clone(),
        motion: motion_name.clone(),
        machine: machine_name.clone(),
        convergence: convergence.clone(),
        learned,
        help: help(arguments, study),
    })
}

/// What lets a machine learn up to the bandwidth that was asked for, where not every one within the intervals would converge.
fn help(arguments: &Arguments, study: &Study) -> Option<String> {
    let Study { compiled, convergence, .. } = study;
    let [_, highest] = convergence.band;
    let damped = compiled.model.task_space.as_ref().is_some_and(|task| task.active_damping);
    let mend = match (damped, convergence.measured) {
        // Its room for knots may be what ends it, and it takes no measured response.
        _ if arguments.on_device.is_some() => return None,
        (false, _) => "damp the modes: `control.active_damping = true`",
        (true, false) => "measure the response: --excite, then --response",
        (true, true) => return None,
    };
    (highest < arguments.bandwidth).then(|| format!("to learn beyond {highest:.0} Hz, {mend}"))
}

fn gate(error: impl Into<LearnError>) -> Failure {
    let error = error.into();
    failure(&error, error.to_string())
}

/// A motion that was not made to its end has no figure.
fn failure(error: &LearnError, message: String) -> Failure {
    match error {
        LearnError::Run(RunError::EndedEarly { .. }) | LearnError::Status(_) => {
            Failure::EndedEarly { message, result: Value::Null }
        }
        _ => Failure::Gate(message),
    }
}

/// The `[control]` of a spec whose controller takes a correction.
pub(super) fn takes_correction(compiled: &Compilation) -> Result<&TaskSpace, Failure> {
    let task = compiled.model.task_space.as_ref().ok_or_else(|| {
        Failure::Gate(
            "learning is for a spec with [control]: legs with their own gauges learn from tick to tick by EWMA and PCC"
                .to_owned(),
        )
    })?;
    if task.correction.is_none() {
        return Err(Failure::Gate(format!(
            "the controller of this spec takes no correction; write correction = \"<number> um\" in [control], at most {} um",
            1e5 * compiled.model.actuator.stroke
        )));
    }
    Ok(task)
}

/// The correction of the first pass, and the ticks from knot to knot.
fn begin(
    arguments: &Arguments,
    compiled: &Compilation,
    learnable: &Learnable,
    motion: &Motion,
    convergence: &Convergence,
    [machine, motion_name]: [&str; 2],
) -> Result<(Vec<Knot>, u32), Failure> {
    let period = compiled.model.timing.period;
    let spacing = convergence.spacing(period);
    if arguments.prepare {
        return Ok((knots(&Update::prepared(learnable, motion, convergence.band[1]), spacing), spacing));
    }
    let Some(path) = &arguments.from else { return Ok((Vec::new(), spacing)) };
    let table = Table::of_file(path).map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))?;
    table
        .is_for(&compiled.ir.digest, machine, motion_name)
        .map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))?;
    Ok((table.knots, table.spacing))
}

/// Why learning ended, and whose correction is kept.
fn kept(learned: &LearningResult) -> Vec<String> {
    // Without passes to learn from there is nothing to say.
    let Some(noise) = learned.noise_nm else { return Vec::new() };
    let last = learned.passes.len() - 1;
    let why = match learned.ending {
        Ending::NoGain => Some(format!("pass {last} gained nothing: learning ended")),
        Ending::Growth => Some(format!("the error grew in pass {last}: learning ended")),
        Ending::AllPasses | Ending::Interruption | Ending::Machine => None,
    };
    let which = match learned.best {
        0 => "kept: the correction of pass 0, which learning began with".to_owned(),
        best => format!("kept: the correction of pass {best}"),
    };
    let noise =
        format!("passes under one correction differ by {noise:.2} nm by the gauges, and a gain is more than that");
    why.into_iter().chain([which, noise]).collect()
}

/// What came of it.
#[derive(Serialize)]
struct Found {
    name: String,
    motion: String,
    machine: String,
    convergence: Convergence,
    #[serde(flatten)]
    learned: LearningResult,
    /// What lets it learn to higher frequencies, where it was asked to.
    #[serde(skip_serializing_if = "Option::is_none")]
    help: Option<String>,
}

impl Outcome for Found {
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
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "  learned {low:.1} to {high:.0} Hz; error times {:.2} a pass or less {}, worst at {:.0} Hz",
            convergence.radius,
            if convergence.measured {
                "by the response\n  as it was measured"
            } else {
                "on every machine within\n  the intervals"
            },
            convergence.at
        );
        let columns = [right(6), right(10), right(10), right(12), left(0).behind("  ")];
        row(&mut text, &columns, &[&"pass", &"nm rms", &"nrad rms", &"gauges, nm", &""]);
        for (number, pass) in learned.passes.iter().enumerate() {
            let Pass { translation_nm, orientation_nrad, measured_nm, status, .. } = pass;
            let said = [if number == learned.best { "kept" } else { "" }.to_owned(), status_words(*status)];
            let said: Vec<String> = said.into_iter().filter(|text| !text.is_empty()).collect();
            row(
                &mut text,
                &columns,
                &[
                    &number,
                    &format_args!("{translation_nm:.1}"),
                    &format_args!("{orientation_nrad:.0}"),
                    &format_args!("{measured_nm:.1}"),
                    &said.join(", "),
                ],
            );
        }
        for line in kept(learned) {
            let _ = writeln!(text, "  {line}");
        }
        if let Some(help) = help {
            let _ = writeln!(text, "help: {help}");
        }
        text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }
}
