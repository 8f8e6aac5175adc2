//! `specgen pil`: processor in the loop. A simulated machine closes the loop with the image of a microcontroller in QEMU, or with
//! a board at a serial port; the host library computes every tick beside it, and every bit is compared.

mod report;
mod scenario;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, Supervised};
use serde_json::json;
use specgen_link::CostUnit;
use specgen_link::client::{Port, Timeout};
use specgen_studies::machine::run_failure;

use super::named::{Endpoint, InputFile, OutputFolder};
use super::plot::Plot;
use super::sim::{PlantArguments, frequency};
use report::Report;
use specgen_compiler::compile::Compilation;
use specgen_compiler::{spec_file, workspace};
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::unread_file;
use specgen_language::ui::{ControllerForm, Ui};
use specgen_language::{files, interrupt};
use specgen_operate::pil::{BAUD, Lockstep, OpenError, Pipes, SerialLine, Stop};
use specgen_toolchain::emulator::Emulator;
use specgen_toolchain::{self as target, Image, stack};

/// Arguments of `pil`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::PIL)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Workspace to write and build in, kept for the next run; NAME-controller if not given, as without a command.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// With [control]: case-1, case-2, glass or aluminium of the paper; case-1 if not given.
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// With [control]: play this trajectory of the spec on board instead.
    #[arg(long, value_name = "NAME", conflicts_with = "scenario")]
    trajectory: Option<String>,
    /// This law alone, as `sim` names them: invhys, ewma, pcc; with [control] p, f-pcc, pf-pcc and others. All that `sim` runs
    /// if not given.
    #[arg(long, value_name = "NAME")]
    mode: Option<String>,
    /// Operating frequency of the scenario, Hz; 10 if not given, 1 for glass and aluminium.
    #[arg(long, value_name = "HZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Without [control]: control ticks per period of the trajectory, 500 if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: Option<u32>,
    /// Only so much of the trajectory, s.
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    plant: PlantArguments,
    /// A board at this serial port, instead of QEMU.
    #[arg(long, value_name = "DEVICE", conflicts_with = "elf")]
    port: Option<Endpoint>,
    /// Its rate, baud.
    #[arg(long, default_value_t = BAUD, requires = "port", value_parser = clap::value_parser!(u32).range(1200..=12_000_000))]
    baud: u32,
    /// Run this image in QEMU, instead of building one.
    #[arg(long, value_name = "FILE")]
    elf: Option<InputFile>,
    #[command(flatten)]
    plot: Plot,
}

fn seconds(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a time from 0.001 to 1000 s, found `{text}`");
    text.parse().ok().filter(|time| (1e-3..=1e3).contains(time)).ok_or_else(expected)
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    // What is wrong with the arguments, or missing on the machine, is reported before the minutes of the rest.
    arguments.plant.options().leg()?;
    arguments.plot.place().wanted()?;
    let compiled = spec_file::compiled(&arguments.spec, ui)?;
    let plan = scenario::Plan::of(arguments, &compiled)?;
    let line = match &arguments.port {
        Some(path) => Some(SerialLine::open(path, arguments.baud).map_err(Failure::Environment)?),
        None => None,
    };
    let given = arguments.elf.as_deref().map(|path| given(path, &compiled)).transpose()?;
    let emulator = if line.is_none() { Some(Emulator::find()?) } else { None };
    if given.is_none() && line.is_none() {
        target::toolchain::find()?;
    }

    let own = PathBuf::from(format!("{}-controller", compiled.ir.name));
    let output = arguments.output.as_deref().unwrap_or(&own).to_owned();
    let hold = workspace::write(&output, &compiled.files)?;
    let target_dir = output.join("target");
    ui.runs(ControllerForm::Emitted);
    ui.progress(&format!("building the host library in {}", output.display()));
    let library = target::host::build_loadable(&output, &target_dir)?;
    let host = Supervised::new(Controller::load(&library).map_err(environment)?);

    match (line, emulator) {
        (Some(line), _) => {
            let name = arguments.port.as_deref().unwrap_or_else(|| Path::new("")).display().to_string();
            let report = Report::new(&compiled, name, None);
            drop(hold);
            in_the_loop(host, line, Timeout::SERIAL, report, &plan, &compiled, arguments, ui)
        }
        (None, Some(emulator)) => {
            let image = given.map_or_else(|| built(&compiled, &output, &target_dir, ui), Ok)?;
            drop(hold);
            let bound = stack::bound(&image.elf, SUPERVISE)?;
            let bound = bound.is_complete().then_some(bound.bytes);
            let name = format!("{} ({}) in {}", image.mcu.part().emulated, image.mcu.part().core, emulator.version);
            let report = Report::new(&compiled, name, bound);
            let pipes = Pipes::start(&emulator, &image)?;
            in_the_loop(host, pipes, Timeout::PIPE, report, &plan, &compiled, arguments, ui)
        }
        // One of the two is there.
        (None, None) => Ok(()),
    }
}

/// The whole tick in the image.
const SUPERVISE: &str = "specgen_supervise";

fn given(path: &Path, compiled: &Compilation) -> Result<Image, Failure> {
    let elf = files::read(path, files::MAX_BYTES).map_err(|unread| unread_file(path, &unread))?;
    Ok(Image { mcu: compiled.model.target.mcu, elf, path: path.to_owned(), compiler: String::new() })
}

fn built(compiled: &Compilation, output: &Path, target_dir: &Path, ui: &Ui) -> Result<Image, Failure> {
    let mcu = compiled.model.target.mcu;
    ui.progress(&format!("building the image for {}", mcu.part().emulated));
    Ok(target::build_pil(output, mcu, target_dir)?)
}

#[allow(clippy::too_many_arguments, reason = "called once for each kind of line")]
fn in_the_loop<P: Port>(
    host: Supervised,
    port: P,
    timeout: Timeout,
    mut report: Report,
    plan: &scenario::Plan,
    compiled: &Compilation,
    arguments: &Arguments,
    ui: &mut Ui,
) -> Result<(), Failure> {
    // From the first tick on there is something to report.
    let mut lockstep = Lockstep::open(host, port, timeout, interrupt::heed()).map_err(|error| match error {
        OpenError::Other(text) => Failure::Gate(text),
        OpenError::Link(_) => Failure::Environment(format!("{}: {error}", report.device)),
    })?;
    report.counted = match lockstep.counted() {
        CostUnit::Instructions => "instructions",
        CostUnit::Cycles => "cycles",
        CostUnit::Nothing => "",
    };
    let done = plan.run(&mut lockstep, &mut report, compiled, arguments, ui);
    report.ticks = lockstep.ticks();
    report.waited = lockstep.waited();
    report.damaged_frames = lockstep.line().1;
    let stop = lockstep.take_stop();
    if !matches!(stop, Some(Stop::Link(_))) {
        match lockstep.costs() {
            Ok(costs) => report.costs = costs,
            Err(error) if stop.is_none() => return Err(Failure::Environment(format!("{}: {error}", report.device))),
            Err(_) => {}
        }
    }
    match (done, stop) {
        (Ok(()), None) => {
            let below = if compiled.model.task_space.is_some() { "target less true pose" } else { "target less gauge" };
            report.plot = arguments.plot.place().charts(&report.name, below, &report.charts)?;
            ui.scored(&report, &report.ended_early)
        }
        (_, Some(stop)) => Err(stopped(stop, report, ui)),
        (Err(Broken::Command(failure)), None) => Err(failure),
        (Err(Broken::Run(error)), None) => Err(run_failure(error)),
    }
}

/// What was done so far, and why it ended.
fn stopped(stop: Stop, mut report: Report, ui: &Ui) -> Failure {
    let text = stop.to_string();
    if !ui.is_json() && report.ticks > 0 {
        ui.out(&report.text());
    }
    match stop {
        Stop::Difference(difference) => {
            let message = format!(
                "{} computes other bits than the host: {difference}; a damaged image, or a defect of specgen to report with the spec",
                report.device
            );
            report.first_difference = Some(difference);
            Failure::Judged { message, result: json!(report) }
        }
        Stop::Supervisor { .. } => Failure::Judged { message: text, result: json!(report) },
        Stop::Interrupted => {
            let message = format!("interrupted after {} ticks, all equal", report.ticks);
            Failure::Interrupted { message, result: json!(report) }
        }
        Stop::Link(_) => Failure::Environment(format!("{}: {text}; {} ticks were equal", report.device, report.ticks)),
        Stop::Settings(_) => Failure::Environment(text),
    }
}

/// Why a plan did not end.
enum Broken {
    Command(Failure),
    /// As a run; why, the lock-step knows best.
    Run(RunError),
}

impl From<RunError> for Broken {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl From<Failure> for Broken {
    fn from(failure: Failure) -> Self {
        Self::Command(failure)
    }
}

/// Runs something and adds how long it took.
fn timed<T>(seconds: &mut f64, run: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let done = run();
    *seconds += start.elapsed().as_secs_f64();
    done
}
