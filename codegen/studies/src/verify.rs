//! Exercises a built controller: the same input record on the host and on the emulated microcontroller, compared bit for
//! bit, with the cost of a tick.

mod legs;
mod platform;

use std::ops::Deref;
use std::path::Path;
use std::time::Duration;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::trace::{Trace, first_difference};
use serde::Serialize;

use specgen_compiler::compile::Compilation;
use specgen_compiler::ir::Ir;
use specgen_language::model::{Mcu, Model};
use specgen_language::outcome::{Failure, environment};
use specgen_toolchain::budget::ImageUsage;
use specgen_toolchain::checks::{self, Rules, TickChecks};
use specgen_toolchain::targets::{Kind, Target};
use specgen_toolchain::time::{Clocks, Estimate};
use specgen_toolchain::{self as target, Image, TargetError, image, size, stack};

/// Ticks of the exercise that a build, `size` and a report run on host and emulated machine.
pub const TICKS: u32 = 20_000;
/// Seed of the noise in the exercise.
const SEED: u64 = 1;
/// The stage of the whole tick.
const WHOLE: &str = "step";
/// Time limit of the emulator.
const LIMIT: Duration = Duration::from_secs(600);

/// Exercises a controller with its current state and configuration: six legs on readings of their own gauges, a platform in closed loop
/// with a simulated machine.
///
/// # Errors
/// The controller lacks a word, or a voltage is not finite.
pub fn exercise(controller: &mut dyn TickController, model: &Model, ir: &Ir, ticks: u32) -> Result<Trace, RunError> {
    match &model.task_space {
        Some(task) => platform::exercise(controller, model, task, ticks),
        None => Ok(legs::exercise(controller, model, ir, ticks)?),
    }
}

/// Loads the controller from a library of this host and exercises it; returns the trace as well.
///
/// # Errors
/// The library cannot be loaded, or as [`exercise`].
pub fn exercised(library: &Path, compiled: &Compilation) -> Result<(Controller, Trace), Failure> {
    let mut controller = Controller::load(library).map_err(environment)?;
    let trace = exercise(&mut controller, &compiled.model, &compiled.ir, TICKS).map_err(environment)?;
    Ok((controller, trace))
}

/// Cost of the image, and whether it computes the same bits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measurement {
    /// Static figures; its checks and its use include what was measured.
    #[serde(flatten)]
    pub image: Inspection,
    /// Bytes of statically allocated RAM plus Config and State: everything but the stack, which [`ImageUsage::ram`] includes.
    pub ram_without_stack: u64,
    /// Bytes of State.
    pub state: u64,
    /// Measured stack use of ticks, bytes.
    pub stack_painted: u64,
    /// Instructions per stage.
    pub stages: Vec<Stage>,
    /// Ticks compared with the host.
    pub ticks: u64,
    /// First word that differs from the host's, as text.
    pub first_difference: Option<String>,
    /// Time of a tick on the spec's board, if it has one; see [`time_board`].
    pub time: Option<Estimate>,
}

impl Deref for Measurement {
    type Target = Inspection;

    fn deref(&self) -> &Inspection {
        &self.image
    }
}

/// Static figures of an image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// Emulated machine of the image.
    pub machine: String,
    /// `rustc --version` of the cross compiler.
    pub compiler: String,
    /// Bytes of flash, replay harness included.
    pub flash: u64,
    /// Of these, code.
    pub code: u64,
    /// Of these, constants (tables).
    pub constants: u64,
    /// Bytes of statically allocated RAM, without Config and State, whose sizes are known only at run time.
    pub ram_static: u64,
    /// Bytes of code that a tick can reach.
    pub tick_code: u64,
    /// Static bound of a tick's stack, bytes; `None` if it cannot be bounded.
    pub stack_bound: Option<u64>,
    /// Panic or allocator symbols in the image.
    pub forbidden_symbols: Vec<String>,
    /// Results of the tick checks.
    pub checks: TickChecks,
    /// Figures for the budget.
    pub used: ImageUsage,
}

/// Instructions of one stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// `step` is the whole tick.
    pub name: String,
    /// Calls measured.
    pub calls: u64,
    /// Fewest instructions.
    pub min: u64,
    /// Mean.
    pub mean: f64,
    /// Most instructions.
    pub max: u64,
}

impl Measurement {
    /// Instructions of a stage.
    pub fn stage(&self, name: &str) -> Option<&Stage> {
        self.stages.iter().find(|stage| stage.name == name)
    }
}

/// Inspects an image without running it.
///
/// # Errors
/// The image was not built by specgen.
pub fn inspect(image: &Image) -> Result<Inspection, TargetError> {
    let footprint = image::footprint(&image.elf)?;
    let bound = stack::bound(&image.elf, stack::STEP_SYMBOL)?;
    let rules = Rules { single: !image.mcu.part().double, whole_image: true };
    let checks = checks::check(&image.elf, Some(stack::STEP_SYMBOL), rules)?;
    Ok(Inspection {
        machine: image.mcu.part().emulated.to_owned(),
        compiler: image.compiler.clone(),
        flash: footprint.flash,
        code: footprint.code,
        constants: footprint.constants,
        ram_static: footprint.ram,
        tick_code: bound.code_bytes,
        stack_bound: bound.is_complete().then_some(bound.bytes),
        forbidden_symbols: footprint.panic_symbols.into_iter().chain(footprint.allocator_symbols).collect(),
        used: used(image, None, &checks)?,
        checks,
    })
}

/// Replays `host`'s inputs with the configuration `config` on the emulated machine and measures it.
///
/// # Errors
/// The emulator is missing or fails, or the image was not built by specgen.
pub fn measure(image: &Image, config: &[u64], host: &Trace) -> Result<Measurement, TargetError> {
    let mut inspection = inspect(image)?;
    let (replayed, stats) = replay(image, config, host)?;
    inspection.checks.check_painted_stack(stats.painted_stack);
    inspection.used = used(image, Some(&stats), &inspection.checks)?;
    let stages = stats.stages.iter().filter(|stage| stage.calls > 0).map(|stage| Stage {
        name: stage.name.clone(),
        calls: stage.calls,
        min: stage.smallest,
        mean: stage.mean(),
        max: stage.largest,
    });
    Ok(Measurement {
        ram_without_stack: inspection.ram_static + stats.state_bytes + stats.config_bytes,
        image: inspection,
        state: stats.state_bytes,
        stack_painted: stats.painted_stack,
        stages: stages.collect(),
        ticks: stats.ticks,
        first_difference: first_difference(host, &replayed).map(|difference| difference.to_string()),
        time: None,
    })
}

/// Number of traced ticks, starting from rest.
const TRACED: usize = 96;
/// Folder of the traced image.
const TICK: &str = "tick";

/// Estimates the time of a tick on a board. Builds the workspace in `folder` into `cache`: the board's image, unless given as
/// `elf`, and that of a tick on the emulated core. `host` is the measured exercise. `None` for a spec without a board.
///
/// # Errors
/// The images cannot be built, or the emulator fails.
pub fn time_board(
    model: &Model,
    mcu: Mcu,
    elf: Option<&[u8]>,
    [folder, cache]: [&Path; 2],
    host: &Trace,
    measurement: &mut Measurement,
) -> Result<(), TargetError> {
    let board = Target::of(mcu);
    if !matches!(board.kind, Kind::Board(_)) {
        return Ok(());
    }
    let toolchain = target::toolchain::find()?;
    let build = |what| target::build::build_folder(&toolchain, folder, what, mcu, cache, false);
    let built;
    let elf = match elf {
        Some(elf) => elf,
        None => {
            built = build(board.name)?.elf;
            &built
        }
    };
    let clocks = Clocks::of(elf, mcu)?;
    let image = build(TICK)?;
    let inputs: Vec<Vec<u64>> = inputs(host).into_iter().take(TRACED).collect();
    let trace = target::trace::trace(&image, &inputs, clocks.buses(), LIMIT)?;
    let spread = measurement.stage(WHOLE).map_or(1.0, |step| step.max as f64 / step.mean.max(1.0));
    measurement.time = Some(Estimate::of(mcu, &clocks, &trace, model.timing.period, spread)?);
    Ok(())
}

/// Resource use of the replay image by owner. Without a run Config and State, hence RAM, and instructions are unknown.
fn used(
    image: &Image,
    stats: Option<&target::replay::ReplayStats>,
    checks: &TickChecks,
) -> Result<ImageUsage, TargetError> {
    let size = size::size(&image.elf)?;
    let stack = checks.stack.unwrap_or(0);
    let words = stats.map_or(Vec::new(), |stats| {
        vec![("State".to_owned(), stats.state_bytes), ("Config".to_owned(), stats.config_bytes)]
    });
    let ram_by: Vec<(String, u64)> =
        words.iter().cloned().chain([("tick stack".to_owned(), stack)]).chain(size.variables.iter().cloned()).collect();
    let ram_least = size.ram() + words.iter().map(|(_, bytes)| bytes).sum::<u64>() + stack;
    Ok(ImageUsage {
        flash: size.flash(),
        flash_by: size.owners.iter().map(|owner| (owner.name.clone(), owner.flash())).collect(),
        ram: stats.is_some().then_some(ram_least).filter(|_| checks.stack.is_some()),
        ram_least,
        ram_by,
        stack: checks.stack,
        stack_by: checks.path.clone(),
        instructions: stats.and_then(|stats| stats.stage(WHOLE)).map(|step| step.mean().ceil() as u64),
        instructions_by: stats.map(per_tick).unwrap_or_default(),
    })
}

/// Instructions of the stages per tick: those of a leg count six times. Each stage is measured only on some ticks, but
/// stages that run once per tick equally often.
fn per_tick(stats: &target::replay::ReplayStats) -> Vec<(String, u64)> {
    let stages = || stats.stages.iter().filter(|stage| stage.name != WHOLE && stage.calls > 0);
    let ticks = stages().map(|stage| stage.calls).min().unwrap_or(1);
    stages().map(|stage| (stage.name.clone(), (stage.sum as f64 / ticks as f64).round() as u64)).collect()
}

/// The inputs of the record, one row per tick.
pub fn inputs(host: &Trace) -> Vec<Vec<u64>> {
    let per_row = host.description().input_names.len();
    host.rows().map(|row| row[..per_row].to_vec()).collect()
}

/// Replays the inputs of the record on the emulated machine; returns its trace and measurements.
///
/// # Errors
/// As [`target::replay()`].
pub fn replay(
    image: &Image,
    config: &[u64],
    host: &Trace,
) -> Result<(Trace, target::replay::ReplayStats), TargetError> {
    let inputs = inputs(host);
    let result = target::replay(image, config, &inputs, LIMIT)?;
    let mut trace = Trace::new(host.description().clone());
    for ((input, output), digest) in inputs.iter().zip(&result.outputs).zip(&result.digests) {
        trace.push(input, output, *digest);
    }
    Ok((trace, result.stats))
}
