//! `specgen report --record`: a run of a machine, replayed and compared bit by bit, and repeated with a simulated machine.

use std::path::Path;

use crate::record::{Run, Sample};
use host_sim::controller::{MachineWord, Supervised};
use host_sim::record::{self, Block};
use specgen_compiler::compile::Compilation;
use specgen_runtime::record::Reason;

use super::beside;
use super::words::Words;
use crate::replay;
use specgen_language::outcome::{Failure, environment};
use specgen_language::ui::Ui;
use specgen_studies::controllers::at_run_time;

/// Phase of the supervisor.
const FAULTED: u8 = 5;

/// Reads a record and replays its ticks, with its own readings and with those of a simulated machine.
pub fn read(path: &Path, compiled: &Compilation, ui: &Ui) -> Result<Run, Failure> {
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{}: {error}", path.display()));
    let mut reader = replay::open(path)?;
    let recorded = &reader.header().description;
    if recorded.digest != compiled.ir.digest {
        return Err(refuse(&format_args!(
            "it was recorded with spec digest {}, but {} has {}; give the spec that the target was built from",
            recorded.digest, compiled.source.display_name, compiled.ir.digest
        )));
    }
    let mut machine = Supervised::new(at_run_time(compiled, ui)?);
    ui.progress("replaying the record");
    let mut blocks: Vec<Block> = Vec::new();
    let header = reader.header().clone();
    let found = record::replay(&mut reader, &mut machine, |_, block, _| blocks.push(block.clone()))
        .map_err(|error| refuse(&error))?;
    if found.ticks == 0 {
        return Err(refuse(&"it contains no ticks; record again"));
    }
    let words = Words::of(&header, &machine, compiled)?;
    let mut run = Run {
        recorded: Vec::new(),
        simulated: Err(String::new()),
        mode: words.mode(&header, &blocks),
        bits: match &found.divergence {
            None => Ok(found.ticks),
            Some(divergence) => Err(format!("DIFFERENT: {divergence}")),
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
    run.recorded = replay_outputs(&mut machine, &blocks, &words)?;
    ui.progress("running the same commands with a simulated machine");
    run.simulated = beside::simulate(&mut machine, &blocks, &words, compiled, &mut run.recorded);
    Ok(run)
}

/// Replays the record for outputs that it does not contain.
fn replay_outputs(machine: &mut Supervised, blocks: &[Block], words: &Words) -> Result<Vec<Sample>, Failure> {
    let mut output = vec![0; machine.output_names().len()];
    let mut samples = Vec::new();
    let mut next = None;
    for block in blocks {
        machine.configure(&block.config).map_err(environment)?;
        if next != Some(block.first) || block.reason == Reason::Started {
            machine
                .load(&block.state)
                .map_err(|_| environment("the record's state does not match; run specgen replay"))?;
        }
        for row in &block.rows {
            let word = machine.step(&row.input, &mut output);
            samples.push(words.sample(row.tick, word, &row.input, &output));
        }
        next = Some(block.first + block.rows.len() as u64);
    }
    Ok(samples)
}
