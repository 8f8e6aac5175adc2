//! Exercises a built controller: the same input record on the host and on the emulated microcontroller, compared bit for
//! bit, with what a tick costs there.

mod legs;
mod platform;

use std::time::Duration;

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::trace::{Trace, first_difference};
use serde::Serialize;

use crate::ir::Ir;
use crate::model::Model;
use crate::target::{self, Image, TargetError, image, stack};

/// Seed of the noise in the exercise.
const SEED: u64 = 1;
/// Longest time the emulator may take, s.
const LIMIT: Duration = Duration::from_secs(600);

/// A controller, reset and configured as it is, at work: six legs on what their own gauges say, a platform in closed loop
/// with a simulated machine.
///
/// # Errors
/// It lacks a word, or a voltage is not finite.
pub fn exercise(controller: &mut dyn TickController, model: &Model, ir: &Ir, ticks: u32) -> Result<Trace, RunError> {
    match &model.task_space {
        Some(task) => platform::exercise(controller, model, task, ticks),
        None => Ok(legs::exercise(controller, model, ir, ticks)?),
    }
}

/// What the image costs and whether it computes the same bits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measurement {
    /// Emulated machine.
    pub machine: String,
    /// `rustc --version` of the cross compiler.
    pub compiler: String,
    /// Bytes of flash, replay harness included.
    pub flash: u64,
    /// Of these, code.
    pub code: u64,
    /// Of these, constants (tables).
    pub constants: u64,
    /// Bytes of RAM taken statically, plus Config and State.
    pub ram: u64,
    /// Bytes of State.
    pub state: u64,
    /// Bytes of code that a tick can reach.
    pub tick_code: u64,
    /// Static bound of a tick's stack, bytes; none if the call graph cannot be bounded.
    pub stack_bound: Option<u64>,
    /// Stack that ticks were seen to use, bytes.
    pub stack_painted: u64,
    /// Panic or allocator symbols in the image.
    pub forbidden_symbols: Vec<String>,
    /// Instructions per stage.
    pub stages: Vec<Stage>,
    /// Ticks compared with the host.
    pub ticks: u64,
    /// First word that differs from the host's, in words.
    pub first_difference: Option<String>,
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
    #[must_use]
    pub fn stage(&self, name: &str) -> Option<&Stage> {
        self.stages.iter().find(|stage| stage.name == name)
    }
}

/// Replays `host`'s inputs under the configuration `config` on the emulated machine and measures it.
///
/// # Errors
/// The emulator is missing or fails, or the image is not one of specgen's.
pub fn measure(image: &Image, config: &[u64], host: &Trace) -> Result<Measurement, TargetError> {
    let footprint = image::footprint(&image.elf)?;
    let bound = stack::bound(&image.elf, stack::STEP_SYMBOL)?;
    let (replayed, stats) = replay(image, config, host)?;
    let stages = stats.stages.iter().filter(|stage| stage.calls > 0).map(|stage| Stage {
        name: stage.name.clone(),
        calls: stage.calls,
        min: stage.smallest,
        mean: stage.mean(),
        max: stage.largest,
    });
    Ok(Measurement {
        machine: image.mcu.machine().to_owned(),
        compiler: image.compiler.clone(),
        flash: footprint.flash,
        code: footprint.code,
        constants: footprint.constants,
        ram: footprint.ram + stats.state_bytes + stats.config_bytes,
        state: stats.state_bytes,
        tick_code: bound.code_bytes,
        stack_bound: bound.is_complete().then_some(bound.bytes),
        stack_painted: stats.painted_stack,
        forbidden_symbols: footprint.panic_symbols.into_iter().chain(footprint.allocator_symbols).collect(),
        stages: stages.collect(),
        ticks: stats.ticks,
        first_difference: first_difference(host, &replayed).map(|difference| difference.to_string()),
    })
}

/// The record's inputs on the emulated machine: its trace, and what was measured.
///
/// # Errors
/// As [`target::replay()`].
pub fn replay(
    image: &Image,
    config: &[u64],
    host: &Trace,
) -> Result<(Trace, target::replay::ReplayStats), TargetError> {
    let inputs_per_row = host.description().input_names.len();
    let inputs: Vec<Vec<u64>> = host.rows().map(|row| row[..inputs_per_row].to_vec()).collect();
    let result = target::replay(image, config, &inputs, LIMIT)?;
    let mut trace = Trace::new(host.description().clone());
    for ((input, output), digest) in inputs.iter().zip(&result.outputs).zip(&result.digests) {
        trace.push(input, output, *digest);
    }
    Ok((trace, result.stats))
}
