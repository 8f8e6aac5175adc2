//! The command `pil`: builds, opens the line, and runs the plan.

use std::path::{Path, PathBuf};

use host_sim::controller::{Controller, Supervised};
use serde_json::json;
use specgen_compiler::compile::Compilation;
use specgen_compiler::workspace;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::unread_file;
use specgen_language::ui::{ControllerForm, Ui};
use specgen_language::{files, interrupt};
use specgen_link::CostUnit;
use specgen_link::client::{Port, Timeout};
use specgen_studies::machine::run_failure;
use specgen_toolchain::emulator::Emulator;
use specgen_toolchain::{self as target, Image, stack};

use super::lockstep::{Lockstep, Stop};
use super::pipes::Pipes;
use super::plan::{Options, Plan, PlanError, Run};
use super::report::Report;
use super::serial::SerialLine;
use super::session::OpenError;

/// Runs the controller of a spec in the loop. `draw` gets every completed run.
///
/// # Errors
/// The options are invalid, a tool is missing, or host and device differ.
pub fn run(
    options: &Options<'_>,
    compiled: &Compilation,
    draw: &mut dyn FnMut(Run<'_>),
    ui: &Ui,
) -> Result<Report, Failure> {
    // Report invalid options and missing tools before the long part of the work.
    let plan = Plan::of(options, compiled)?;
    let line =
        options.port.map(|(path, baud)| SerialLine::open(path, baud).map_err(Failure::Environment)).transpose()?;
    let given = options.elf.map(|path| given(path, compiled)).transpose()?;
    let emulator = if line.is_none() { Some(Emulator::find()?) } else { None };
    if given.is_none() && line.is_none() {
        target::toolchain::find()?;
    }

    let own = PathBuf::from(format!("{}-controller", compiled.ir.name));
    let output = options.output.unwrap_or(&own).to_owned();
    let hold = workspace::write(&output, &compiled.files())?;
    let target_dir = output.join("target");
    ui.runs(ControllerForm::Emitted);
    ui.progress(&format!("building the host library in {}", output.display()));
    let library = target::host::build_loadable(&output, &target_dir)?;
    let host = Supervised::new(Controller::load(&library).map_err(environment)?);
    let job = Job { options, plan, compiled, host, draw, ui };

    let Some(emulator) = emulator else {
        drop(hold);
        let name = options.port.map(|(path, _)| path.display().to_string()).unwrap_or_default();
        let line = line.ok_or_else(|| Failure::Usage("name the board with --port".to_owned()))?;
        return close(job, line, Timeout::SERIAL, Report::new(compiled, name, None));
    };
    let image = given.map_or_else(|| built(compiled, &output, &target_dir, ui), Ok)?;
    drop(hold);
    let bound = stack::bound(&image.elf, SUPERVISE)?;
    let bound = bound.is_complete().then_some(bound.bytes);
    let name = format!("{} ({}) in {}", image.mcu.part().emulated, image.mcu.part().core, emulator.version);
    let pipes = Pipes::start(&emulator, &image)?;
    close(job, pipes, Timeout::PIPE, Report::new(compiled, name, bound))
}

/// Symbol of the whole tick in the image.
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

/// The parts of a closed loop.
struct Job<'a> {
    options: &'a Options<'a>,
    plan: Plan,
    compiled: &'a Compilation,
    host: Supervised,
    draw: &'a mut dyn FnMut(Run<'_>),
    ui: &'a Ui,
}

fn close<P: Port>(job: Job<'_>, port: P, timeout: Timeout, mut report: Report) -> Result<Report, Failure> {
    let Job { options, plan, compiled, host, draw, ui } = job;
    // From here on an interrupt reports the result so far.
    let mut lockstep = Lockstep::open(host, port, timeout, interrupt::heed()).map_err(|error| match error {
        OpenError::Other(text) => Failure::Gate(text),
        OpenError::Link(_) => Failure::Environment(format!("{}: {error}", report.device)),
    })?;
    report.counted = match lockstep.counted() {
        CostUnit::Instructions => "instructions",
        CostUnit::Cycles => "cycles",
        CostUnit::Nothing => "",
    };
    let done = plan.run(&mut lockstep, &mut report, compiled, options, draw, ui);
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
        (Ok(()), None) => Ok(report),
        (_, Some(stop)) => Err(stopped(stop, report, ui)),
        (Err(PlanError::Command(failure)), None) => Err(failure),
        (Err(PlanError::Run(error)), None) => Err(run_failure(error)),
    }
}

/// The failure of a lock-step that stopped, with the result so far.
fn stopped(stop: Stop, mut report: Report, ui: &Ui) -> Failure {
    let text = stop.to_string();
    if !ui.is_json() && report.ticks > 0 {
        ui.out(&report.text());
    }
    match stop {
        Stop::Difference(difference) => {
            let message = format!(
                "{} computes other bits than the host: {difference}; either the image is damaged, or this is a bug in specgen: report it with the spec",
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
