//! `specgen report --record`: a run of a machine, run again by bits, and with a simulated machine in its place.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use host_sim::controller::{MachineWord, Supervised, TickController};
use host_sim::record::{self, Block, Header, Reader};
use host_sim::word::Scalar;
use specgen_compiler::compile::Compiled;
use specgen_compiler::lower;
use specgen_report::record::{Run, Sample};
use specgen_runtime::record::Reason;
use specgen_runtime::supervisor::MISSED_TICK;

use super::beside;
use crate::cli::sim::platform::LEG_LIMITED;
use crate::cli::sim::{emitted, environment};
use crate::cli::ui::{Failure, Ui};

/// Phases of the supervisor.
const RUNNING: u8 = 2;
const FAULTED: u8 = 5;

/// Reads a record and runs its ticks again, with its own readings and with those of a simulated machine.
pub fn read(path: &Path, compiled: &Compiled, ui: &Ui) -> Result<Run, Failure> {
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{}: {error}", path.display()));
    let file = File::open(path).map_err(|error| refuse(&format_args!("cannot be read: {error}")))?;
    let mut reader = Reader::new(BufReader::with_capacity(1 << 20, file)).map_err(|error| refuse(&error))?;
    let recorded = &reader.header().description;
    if recorded.digest != compiled.ir.digest {
        return Err(refuse(&format_args!(
            "it is of spec digest {}, {} gives {}; name the spec that the target was built from",
            recorded.digest, compiled.source.display_name, compiled.ir.digest
        )));
    }
    let mut machine = Supervised::new(emitted(compiled, ui)?).map_err(environment)?;
    ui.progress("running the record again");
    let mut blocks: Vec<Block> = Vec::new();
    let header = reader.header().clone();
    let found = record::replay(&mut reader, &mut machine, |_, block, _| blocks.push(block.clone()))
        .map_err(|error| refuse(&error))?;
    if found.ticks == 0 {
        return Err(refuse(&"there is no tick in it; record again"));
    }
    let words = Words::of(&header, &machine, compiled)?;
    let mut run = Run {
        recorded: Vec::new(),
        simulated: Err(String::new()),
        mode: words.mode(&header, &blocks),
        bits: match &found.divergence {
            None => Ok(found.ticks),
            Some(divergence) => Err(format!("DIFFER: {divergence}")),
        },
        gaps: found.gaps.clone(),
        damaged: found.damaged.iter().map(|(block, reason)| format!("Block {block} is damaged: {reason}.")).collect(),
        phases: Vec::new(),
        faults: 0,
    };
    for change in &found.phases {
        let word = MachineWord::of(u64::from(change.supervisor));
        run.faults += usize::from(word.phase == FAULTED);
        run.phases.push((change.tick, format!("{word}, amplifiers {}", if word.amplifier_on { "on" } else { "off" })));
    }
    run.recorded = again(&mut machine, &blocks, &words)?;
    ui.progress("the same commands with a simulated machine");
    run.simulated = beside::simulate(&mut machine, &blocks, &words, compiled, &mut run.recorded);
    Ok(run)
}

/// Where the words are that a page needs.
pub(super) struct Words {
    pub(super) scalar: Scalar,
    pub(super) gauge: [usize; 6],
    pub(super) wrench: Option<[usize; 6]>,
    pub(super) events: usize,
    voltage: [usize; 6],
    status: usize,
    /// Among the outputs, or among the inputs.
    target: Result<[usize; 6], [usize; 6]>,
    measured: Result<[usize; 6], [usize; 6]>,
    /// From a pose to the legs; none for legs with gauges of their own.
    jacobian: Option<[[f64; 6]; 6]>,
    /// Reading of each gauge in V to m, lowest power first.
    calibration: Option<[Vec<f64>; 6]>,
}

impl Words {
    fn of(header: &Header, machine: &Supervised, compiled: &Compiled) -> Result<Self, Failure> {
        let names = header.input_names();
        let description = machine.controller().description();
        let inputs = |stem: &str| -> Option<[usize; 6]> {
            let places: Vec<usize> =
                (0..6).map_while(|k| names.iter().position(|name| *name == format!("{stem}[{k}]"))).collect();
            places.try_into().ok()
        };
        let lacking = || environment("the controller lacks words of its gauges; report this as a defect of specgen");
        let gauge = inputs("gauge").or_else(|| inputs("displacement")).ok_or_else(lacking)?;
        let setpoint = inputs("setpoint").ok_or_else(lacking)?;
        let either = |output: &str, input: [usize; 6]| description.outputs(output).map_err(|_| input);
        let jacobian = match &compiled.model.task_space {
            Some(_) => lower::platform(&compiled.model).ok().map(|platform| platform.jacobian(&[0.0; 6])),
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

    /// The control mode in force while most of it was recorded: of the last block.
    fn mode(&self, header: &Header, blocks: &[Block]) -> u32 {
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

/// The record once more, for the outputs that it does not hold.
fn again(machine: &mut Supervised, blocks: &[Block], words: &Words) -> Result<Vec<Sample>, Failure> {
    let mut output = vec![0; machine.output_names().len()];
    let mut samples = Vec::new();
    let mut next = None;
    for block in blocks {
        machine.configure(&block.config).map_err(environment)?;
        if next != Some(block.first) || block.reason == Reason::Started {
            machine
                .load(&block.state)
                .map_err(|_| environment("the record's state does not fit; run specgen replay"))?;
        }
        for row in &block.rows {
            let word = machine.step(&row.input, &mut output);
            samples.push(words.sample(row.tick, word, &row.input, &output));
        }
        next = Some(block.first + block.rows.len() as u64);
    }
    Ok(samples)
}
