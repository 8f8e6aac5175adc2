//! `specgen sim`: a spec's controller on simulated machines that are not of its model class: the motions of the user's own
//! platform, or the paper's experiments.

pub(super) mod legs;
pub(super) mod platform;
mod record;

use std::fmt::Display;

use clap::Args;
use host_sim::controller::{Controller, ControllerError, TickController};
use host_sim::description::Description;
use host_sim::plant::{LegParameters, NoiseParameters};

use super::named::{InputFile, OutputFile, OutputFolder};
use super::plot::Plot;
use super::spec;
use specgen_compiler::compile;
use specgen_compiler::workspace;
use specgen_language::files;
use specgen_language::interrupt::{self, Scratch};
use specgen_language::outcome::Failure;
use specgen_language::output::{check_place, claim, write_folder};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_toolchain as target;

/// Arguments of `sim`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::SIM)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Write tables here; only print without it.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// Write every tick of every run there, too; their size is said first.
    #[arg(long, requires = "output")]
    traces: bool,
    #[command(flatten)]
    plot: Plot,
    /// The paper's experiments, ours beside the paper's, instead of the platform's own motions.
    #[arg(long)]
    paper: bool,
    #[command(flatten)]
    plant: PlantArguments,
    /// Without [control]: control ticks per period of the motion. The spec's period if not given, with --paper 500. The law is
    /// held against the stability check at the interval that this gives.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: Option<u32>,
    /// Frequencies of the motions, with --paper of cases 1 and 2, Hz; 1 and 10 if not given. 0.1 takes ten times as long as 1.
    #[arg(long, value_name = "HZ", value_delimiter = ',', value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<Vec<f64>>,
    /// With [control]: play this trajectory of the spec on board, and nothing else.
    #[arg(long, value_name = "NAME", conflicts_with = "paper")]
    trajectory: Option<String>,
    /// With [control]: control intervals by which voltages reach the amplifiers late.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=100))]
    latency: u32,
    /// With [control]: the machine in steps of 20 µs, which the usual ones, as long as the control interval, are held against.
    /// Several times slower.
    #[arg(long, conflicts_with = "record")]
    small_steps: bool,
    /// Instead of the experiments: a wave on all axes under the supervisor, every tick of it recorded in this file for
    /// `specgen replay`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["output", "plot", "paper", "samples", "frequency", "trajectory"])]
    record: Option<OutputFile>,
    /// Build the emitted controller and run that, which needs Rust. Without it the same law runs on the constants of the compiled
    /// spec, with the same bits.
    #[arg(long)]
    emitted: bool,
    /// Length of that wave, s.
    #[arg(long, value_name = "S", default_value_t = 1.0, requires = "record", allow_negative_numbers = true)]
    seconds: f64,
}

/// Frequencies of motions, Hz, unless asked otherwise.
const FREQUENCIES: [f64; 2] = [1.0, 10.0];

impl Arguments {
    fn frequencies(&self) -> &[f64] {
        self.frequency.as_deref().unwrap_or(&FREQUENCIES)
    }
}

/// Writes tables, and traces if they are asked for, whose size is said before.
fn write_files(arguments: &Arguments, tables: Vec<File>, traces: Vec<File>, ui: &Ui) -> Result<(), Failure> {
    let Some(folder) = &arguments.output else { return Ok(()) };
    let mut files = tables;
    if arguments.traces {
        let megabytes = traces.iter().map(|(_, bytes)| bytes.len()).sum::<usize>() as f64 / 1e6;
        ui.progress(&format!("writing {} traces, {megabytes:.1} MB, to {}", traces.len(), folder.display()));
        files.extend(traces);
    }
    write_folder(folder, &files)?;
    ui.progress(&format!("wrote {} files to {}", files.len(), folder.display()));
    Ok(())
}

/// Name and bytes.
type File = (String, Vec<u8>);

/// A frequency at which a trajectory has a sensible length.
pub(super) fn frequency(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a frequency from 0.001 to 1000 Hz, found `{text}`");
    let hertz: f64 = text.trim().trim_end_matches("Hz").trim().parse().map_err(|_| expected())?;
    if (1e-3..=1e3).contains(&hertz) { Ok(hertz) } else { Err(expected()) }
}

/// Which leg is simulated.
#[derive(Args, Debug)]
pub struct PlantArguments {
    /// Leg whose shape of hysteresis is taken and scaled to the legs of the spec: `plays`, as if not given, `bouc-wen`, or a file
    /// of leg parameters (JSON). The paper's experiments with six legs take them as they are.
    #[arg(long, value_name = "LEG")]
    pub(super) plant: Option<InputFile>,
    /// Without noise and quantisation of gauge and amplifier.
    #[arg(long)]
    pub(super) no_noise: bool,
    /// Seed of the noise, and with [control] of the tolerances of the machine.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub(super) seed: u64,
}

impl PlantArguments {
    pub(super) fn leg(&self) -> Result<LegParameters, Failure> {
        match &self.plant {
            Some(path) => LegParameters::named(path, files::text).map_err(|error| Failure::Gate(error.to_string())),
            None => Ok(LegParameters::reference()),
        }
    }

    pub(super) fn read(&self) -> Result<(LegParameters, NoiseParameters), Failure> {
        let parameters = self.leg()?;
        let noise = if self.no_noise { NoiseParameters::NONE } else { parameters.noise };
        Ok((parameters, noise))
    }
}

pub(super) fn environment(error: impl Display) -> Failure {
    Failure::Environment(error.to_string())
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    // A bad plant file is refused before the minutes of the rest.
    arguments.plant.read()?;
    let compiled = spec::compiled(&arguments.spec, ui)?;
    let task = compiled.model.task_space.as_ref();
    match task {
        Some(task) => platform::check(arguments, task)?,
        None => legs::check(arguments, &compiled)?,
    }
    arguments.plot.wanted()?;
    // A place that cannot be is refused before the minutes of the rest, too.
    let _claimed = arguments.output.as_deref().map(claim).transpose()?;
    arguments.record.as_deref().map_or(Ok(()), check_place)?;
    let controller = controller(&compiled, arguments.emitted, ui)?;
    if let Some(path) = &arguments.record {
        return record::run(arguments, path, &compiled, controller, ui);
    }
    let mut controller = Interruptible(controller);
    match task {
        Some(task) => platform::run(arguments, &compiled, task, &mut controller, ui),
        None => legs::run(arguments, &compiled, &mut controller, ui),
    }
}

/// A controller whose runs end with the command.
struct Interruptible(Controller);

impl TickController for Interruptible {
    fn description(&self) -> &Description {
        self.0.description()
    }
    fn default_config(&self) -> Vec<u64> {
        self.0.default_config()
    }
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.0.configure(words)
    }
    fn reset(&mut self) {
        self.0.reset();
    }
    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        interrupt::point();
        self.0.step(input, output);
    }
    fn state_digest(&self) -> u64 {
        self.0.state_digest()
    }
}

/// The controller that a command runs: the emitted one if the user asks for it.
pub(super) fn controller(compiled: &compile::Compilation, is_emitted: bool, ui: &Ui) -> Result<Controller, Failure> {
    if is_emitted { emitted(compiled, ui) } else { at_run_time(compiled, ui) }
}

/// The law on the constants of a compiled spec: the bits of the emitted controller, and nothing is built.
pub(super) fn at_run_time(compiled: &compile::Compilation, ui: &Ui) -> Result<Controller, Failure> {
    ui.runs(ControllerForm::RunTime);
    ui.progress("controller: the compiled spec, not built");
    specgen_run_time::controller(&compiled.ir).map_err(environment)
}

/// The emitted controller, built for this host from the same files that the main job writes. What it was built in is gone
/// when this returns; the library stays loaded.
fn emitted(compiled: &compile::Compilation, ui: &Ui) -> Result<Controller, Failure> {
    let scratch = Scratch::new().map_err(environment)?;
    let workspace = scratch.path().join("controller");
    workspace::write_scratch(&workspace, &compiled.files)?;
    ui.runs(ControllerForm::Emitted);
    ui.progress("controller: the emitted one, built for this host");
    let library = target::host::build_loadable(&workspace, &scratch.path().join("target"))?;
    Controller::load(&library).map_err(environment)
}
