//! Exercises a built controller: the same input record on the host and on the emulated microcontroller, compared bit for
//! bit, with what a tick costs there.

use std::f64::consts::TAU;
use std::time::Duration;

use host_sim::controller::{Controller, ControllerError, TickController};
use host_sim::noise::Gaussian;
use host_sim::trace::{Trace, first_difference};
use serde::Serialize;

use crate::ir::{Ir, LEGS, Setpoint};
use crate::model::Model;
use crate::target::{self, Image, TargetError, image, stack};

/// Seed of the gauge noise in the exercise.
const SEED: u64 = 1;
/// Longest time the emulator may take, s.
const LIMIT: Duration = Duration::from_secs(600);

/// A controller, reset and configured as it is, under the exercise.
///
/// # Errors
/// It lacks a word.
pub fn exercise(controller: &mut Controller, model: &Model, ir: &Ir, ticks: u32) -> Result<Trace, ControllerError> {
    controller.reset();
    let description = controller.description().clone();
    let mut trace = Trace::new(description.clone());
    let mut noise: Vec<Gaussian> = (0..LEGS as u64).map(|leg| Gaussian::new(model.sensor.noise, SEED, leg)).collect();
    let mut input = vec![0; description.input_names.len()];
    let mut output = vec![0; description.output_names.len()];
    let mut reading = [0.0; LEGS];
    let requested = description.output("requested[0]")?;
    for tick in 0..ticks {
        let time = f64::from(tick + 1) * model.timing.period;
        for (word, value) in input.iter_mut().zip(setpoint(model, ir, time).into_iter().chain(reading)) {
            *word = description.scalar.encode(value);
        }
        controller.step(&input, &mut output);
        trace.push(&input, &output, controller.state_digest());
        for ((reading, noise), word) in reading.iter_mut().zip(&mut noise).zip(&output[requested..]) {
            *reading = description.scalar.decode(*word) + noise.draw();
        }
    }
    Ok(trace)
}

/// A slow motion in all six axes about the middle of the stroke, within the accepted set-points.
fn setpoint(model: &Model, ir: &Ir, time: f64) -> [f64; 6] {
    let reach = ir
        .hysteresis
        .tables
        .iter()
        .filter_map(|nodes| nodes.get(nodes.len() - 1 - ir.hysteresis.grid))
        .fold(model.actuator.stroke, |least, full| if *full < least { *full } else { least });
    let swing = |axis: u32| libm::sin(TAU * (2.0 + 0.7 * f64::from(axis)) * time + f64::from(axis));
    match ir.defaults.setpoint {
        Setpoint::Leg => [0, 1, 2, 3, 4, 5].map(|leg| reach * (0.5 + 0.3 * swing(leg))),
        Setpoint::Pose => {
            let bounds = ir.bounds.pose;
            let within = |axis: usize, value: f64| {
                let limit = 0.95 * bounds[axis];
                if value > limit { limit } else { value }
            };
            // A rise of z lengthens every leg by its vertical share.
            let lift = reach * ir.kinematics.rest_length[0] / model.geometry.height;
            let turn = reach / model.geometry.joint_radius();
            [
                within(0, 0.1 * lift) * swing(0),
                within(1, 0.1 * lift) * swing(1),
                within(2, 0.5 * lift) * (0.8 + 0.2 * swing(2)),
                within(3, 0.05 * turn) * swing(3),
                within(4, 0.05 * turn) * swing(4),
                within(5, 0.05 * turn) * swing(5),
            ]
        }
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
