//! `specgen learn`: a motion that repeats, learned between passes on the simulated machine of a spec.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use host_sim::platform::rig::{Bench, Noise};
use host_sim::word::status_words;
use serde::Serialize;

use super::file::{check_place, write_file};
use super::robust::trajectory;
use super::sim::{PlantArguments, emitted, environment, frequency};
use super::spec;
use super::table::{left, right, row};
use super::ui::{Failure, Outcome, Ui};
use specgen_compiler::compile::Compiled;
use specgen_language::interrupt;
use specgen_language::model::TaskSpace;
use specgen_runtime::playback::Knot;
use specgen_studies::learning::{
    Convergence, LearnError, Learnable, Learned, Motion, Pass, Table, Update, knots, learn,
};
use specgen_studies::machine;
use specgen_studies::robust::Factors;
use specgen_studies::robust::factors::Given;

/// Highest frequency that is learned unless asked otherwise, Hz.
const BANDWIDTH: f64 = 800.0;
/// How long the machine may take to its bias pose, s.
const ARMING: f64 = 60.0;

/// Arguments of `learn`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LEARN)]
pub struct Arguments {
    /// The spec file, with `control.correction`.
    spec: PathBuf,
    /// What is learned: case-1, case-2, machining or multisine, or a trajectory of the spec by its name; case-1 if not given.
    #[arg(long, value_name = "NAME")]
    trajectory: Option<String>,
    /// Its operating frequency, Hz; 10, or that of the spec, if not given.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Passes that are learned from; one more shows what came of them.
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=1000))]
    passes: u32,
    /// Highest frequency to be learned, Hz; lowered to where every machine within [robust] converges.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true, default_value_t = BANDWIDTH)]
    bandwidth: f64,
    /// Range of an uncertainty, in place of that of [robust] or the default: `stiffness=2%`, `gain=0.9:1.1`, `delay_ticks=0`.
    #[arg(long, value_name = "NAME=RANGE", value_parser = Given::parse)]
    vary: Vec<Given>,
    /// Begin with what the model says lag and modes would leave.
    #[arg(long, conflicts_with = "from")]
    prepare: bool,
    /// Begin with this correction, of the same spec, machine and motion.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Write the correction of the best pass here (JSON).
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    plant: PlantArguments,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let (leg, noise) = (arguments.plant.leg()?, !arguments.plant.no_noise);
    let compiled = spec::compiled(&arguments.spec, ui)?;
    let model = &compiled.model;
    let seed = arguments.plant.seed;
    let task = takes_correction(&compiled)?;
    let followed = trajectory::chosen(arguments.trajectory.as_deref(), arguments.frequency, seed, &compiled)?;
    let motion_name = format!("{} at {} Hz", followed.name, followed.frequency);
    let shape = arguments.plant.plant.as_ref().map_or_else(|| "plays".to_owned(), |path| path.display().to_string());
    let machine_name = format!("simulated, {shape}, seed {seed}");
    arguments.output.as_deref().map_or(Ok(()), check_place)?;
    let learnable = Learnable::of(&compiled)
        .ok_or_else(|| Failure::Environment("the platform has no modes, which the spec was checked for".to_owned()))?;
    let factors = Factors::of(model, &arguments.vary);
    let convergence = learnable.convergence(&factors, arguments.bandwidth).ok_or_else(|| {
        Failure::Gate(
            "learning converges at no frequency on every machine within the declared intervals; narrow them in [robust] or by \
             --vary, such as stiffness=2%, once they are measured"
                .to_owned(),
        )
    })?;
    let trajectory = followed.choice.of_platform(model, task);
    let speed = task.setpoint.speed;
    let motion =
        Motion::of(trajectory.as_ref(), model.timing.period, &speed, model.geometry.joint_radius()).map_err(gate)?;
    let (begin, spacing) =
        begin(arguments, &compiled, &learnable, &motion, &convergence, [&machine_name, &motion_name])?;

    let mut controller = emitted(&compiled, ui)?;
    let specimen = machine::specimen(model, task, &leg, Some(seed));
    let noise = if noise { Noise::of(&specimen) } else { Noise::NONE };
    let scenario = machine::scenario(model, task, &specimen, &noise, seed);
    let mut rig = scenario.rig().clone();
    let mut bench = Bench::new(&mut rig, &mut controller, model.timing.period, 0).map_err(environment)?;
    bench.arm(ARMING).map_err(gate)?;
    let update = Update::new(&learnable, &motion, &convergence);
    let stop = interrupt::heed();
    let count = arguments.passes as usize;
    let learned = learn(&mut bench, &motion, &update, &begin, spacing, count, |number, pass| {
        ui.rate(&format!("learn: pass {number} of {count}, {:.1} nm", pass.translation_nm));
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    ui.rate_done();
    let learned = learned.map_err(gate)?;
    if let Some(path) = &arguments.output {
        let table = Table::new(&compiled.ir.digest, &machine_name, &motion_name, spacing, learned.knots.clone());
        write_file(path, table.to_json().as_bytes())?;
        ui.progress(&format!("wrote {} knots to {}", learned.knots.len(), path.display()));
    }
    let ended = learned.passes.len() <= count && !learned.grew;
    let found =
        Found { name: compiled.ir.name.clone(), motion: motion_name, machine: machine_name, convergence, learned };
    if ended {
        let message = "interrupted: the best pass so far is kept".to_owned();
        return Err(Failure::Interrupted { message, result: ui.shown(&found) });
    }
    ui.result(&found);
    Ok(())
}

fn gate(error: impl Into<LearnError>) -> Failure {
    Failure::Gate(error.into().to_string())
}

/// The `[control]` of a spec whose controller takes a correction.
fn takes_correction(compiled: &Compiled) -> Result<&TaskSpace, Failure> {
    let task = compiled.model.task_space.as_ref().ok_or_else(|| {
        Failure::Gate(
            "learning is for a spec with [control]: legs with their own gauges learn from tick to tick by EWMA and PCC"
                .to_owned(),
        )
    })?;
    if task.correction.is_none() {
        return Err(Failure::Gate(
            "the controller of this spec takes no correction; write correction = \"2 um\" in [control]".to_owned(),
        ));
    }
    Ok(task)
}

/// The correction of the first pass, and the ticks from knot to knot.
fn begin(
    arguments: &Arguments,
    compiled: &Compiled,
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
    let table = read(path)?;
    table
        .is_for(&compiled.ir.digest, machine, motion_name)
        .map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))?;
    Ok((table.knots, table.spacing))
}

fn read(path: &Path) -> Result<Table, Failure> {
    let text = fs::read_to_string(path).map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))?;
    Table::read(&text).map_err(|error| Failure::Gate(format!("{}: {error}", path.display())))
}

/// What came of it.
#[derive(Serialize)]
struct Found {
    name: String,
    motion: String,
    machine: String,
    convergence: Convergence,
    #[serde(flatten)]
    learned: Learned,
}

impl Outcome for Found {
    fn text(&self) -> String {
        let Self { name, motion, machine, convergence, learned } = self;
        let [low, high] = convergence.band;
        let (first, best) = (&learned.passes[0], &learned.passes[learned.best]);
        let mut text = format!(
            "{name}: {motion}, {:.1} -> {:.1} nm rms in {} passes ({machine})\n",
            first.translation_nm, best.translation_nm, learned.best
        );
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "  learned {low:.1} to {high:.0} Hz; error times {:.2} a pass or less on every machine within\n  the intervals, worst at \
             {:.0} Hz",
            convergence.radius, convergence.at
        );
        let columns = [right(6), right(10), right(10), right(12), left(0).behind("  ")];
        row(&mut text, &columns, &[&"pass", &"nm rms", &"nrad rms", &"gauges, nm", &""]);
        for (number, pass) in learned.passes.iter().enumerate() {
            let Pass { translation_nm, orientation_nrad, measured_nm, status } = pass;
            let said = [if number == learned.best { "best" } else { "" }.to_owned(), status_words(*status)];
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
        if learned.grew {
            text.push_str("  the error grew: learning ended, the best pass is kept\n");
        }
        text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }
}
