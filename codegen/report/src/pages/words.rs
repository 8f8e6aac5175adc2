//! Positions of the words that a page shows, in a record and its controller.

use crate::record::Sample;
use host_sim::controller::{MachineWord, Supervised, TickController};
use host_sim::record::{Block, Header};
use host_sim::word::Scalar;
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_numerics::jacobian;
use specgen_runtime::supervisor::MISSED_TICK;

use specgen_language::outcome::{Failure, environment};
use specgen_studies::runs::LEG_LIMITED;

/// Phase of the supervisor.
const RUNNING: u8 = 2;

/// Positions of words.
pub(super) struct Words {
    pub(super) scalar: Scalar,
    pub(super) gauge: [usize; 6],
    pub(super) wrench: Option<[usize; 6]>,
    pub(super) events: usize,
    voltage: [usize; 6],
    status: usize,
    /// Position among the outputs, or among the inputs.
    target: Result<[usize; 6], [usize; 6]>,
    measured: Result<[usize; 6], [usize; 6]>,
    /// Jacobian from pose to legs; `None` for legs with their own gauges.
    jacobian: Option<[[f64; 6]; 6]>,
    /// Calibration of each gauge, V to m, lowest power first.
    calibration: Option<[Vec<f64>; 6]>,
}

impl Words {
    pub(super) fn of(header: &Header, machine: &Supervised, compiled: &Compilation) -> Result<Self, Failure> {
        let names = header.input_names();
        let description = machine.controller().description();
        let inputs = |stem: &str| -> Option<[usize; 6]> {
            let places: Vec<usize> =
                (0..6).map_while(|k| names.iter().position(|name| *name == format!("{stem}[{k}]"))).collect();
            places.try_into().ok()
        };
        let lacking = || environment("the controller lacks words of its gauges; report this as a specgen bug");
        let gauge = inputs("gauge").or_else(|| inputs("displacement")).ok_or_else(lacking)?;
        let setpoint = inputs("setpoint").ok_or_else(lacking)?;
        let either = |output: &str, input: [usize; 6]| description.outputs(output).map_err(|_| input);
        let jacobian = match &compiled.model.task_space {
            Some(_) => lower::platform(&compiled.model).ok().map(|platform| jacobian(&platform, &[0.0; 6])),
            None => None,
        };
        Ok(Self {
            scalar: description.scalar,
            gauge,
            wrench: inputs("wrench"),
            events: names.iter().position(|name| name == "events").ok_or_else(lacking)?,
            voltage: description.outputs("voltage").map_err(environment)?,
            status: description.output("status").map_err(environment)?,
            target: either("target", setpoint),
            measured: either("pose", gauge),
            jacobian,
            calibration: compiled.model.task_space.as_ref().and_then(|task| task.calibration.clone()),
        })
    }

    /// The control mode of the last block, which is that of most of the record.
    pub(super) fn mode(&self, header: &Header, blocks: &[Block]) -> u32 {
        let place = header.description.config_names.iter().position(|name| name == "mode");
        let word = blocks.last().zip(place).and_then(|(block, place)| block.config.get(place));
        word.and_then(|word| u32::try_from(*word).ok()).unwrap_or_default()
    }

    pub(super) fn sample(&self, tick: u64, word: MachineWord, input: &[u64], output: &[u64]) -> Sample {
        let six = |places: &[usize; 6], words: &[u64]| places.map(|place| self.scalar.decode(words[place]));
        let mut gauge = six(&self.gauge, input);
        if let Some(calibration) = &self.calibration {
            for (value, coefficients) in gauge.iter_mut().zip(calibration) {
                *value = coefficients.iter().rev().fold(0.0, |sum, c| sum * *value + c);
            }
        }
        let of = |places: &Result<[usize; 6], [usize; 6]>| match places {
            Ok(places) => six(places, output),
            Err(places) => six(places, input),
        };
        let measured = of(&self.measured);
        let leg = self
            .jacobian
            .map_or(measured, |rows| rows.map(|row| row.iter().zip(&measured).fold(0.0, |sum, (j, h)| sum + j * h)));
        Sample {
            tick,
            running: word.phase == RUNNING,
            scored: word.phase == RUNNING,
            gauge,
            target: of(&self.target),
            measured,
            leg,
            voltage: six(&self.voltage, output),
            limited: output[self.status] & u64::from(LEG_LIMITED) != 0,
            late: input[self.events] & u64::from(MISSED_TICK) != 0,
        }
    }
}
