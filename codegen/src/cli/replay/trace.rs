//! The record of a real-time PC: a trace of supervised ticks from power-up on, with the spec's settings.

use std::fs;
use std::io::Read;
use std::path::Path;

use host_sim::controller::Supervised;
use host_sim::trace::{Trace, first_difference};
use serde_json::json;

use super::super::file::PendingFile;
use super::super::sim;
use super::super::ui::{Failure, Ui};
use super::{Arguments, same_build};
use crate::compile::Compiled;

/// What such a file begins with.
const MAGIC: &[u8; 8] = b"SPGTRACE";

/// Whether it is one.
pub(super) fn is_trace(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    fs::File::open(path).is_ok_and(|mut file| file.read_exact(&mut start).is_ok()) && start == *MAGIC
}

/// Reads it.
pub(super) fn read(path: &Path) -> Result<Trace, Failure> {
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{}: {error}", path.display()));
    let bytes = fs::read(path).map_err(|error| refuse(&format_args!("cannot be read: {error}")))?;
    Trace::from_bytes(&bytes).map_err(|error| {
        refuse(&format_args!(
            "{error}; a run that was killed leaves its record without an end: end runs by SIGINT or SIGTERM"
        ))
    })
}

/// Writes it as CSV; returns the number of rows.
pub(super) fn export(trace: &Trace, path: &Path) -> Result<u64, Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::Environment(format!("could not write the CSV: {error}"));
    let mut file = PendingFile::create(path)?;
    std::io::Write::write_all(&mut file, trace.to_csv().as_bytes()).map_err(|error| failed(&error))?;
    file.keep()?;
    Ok(trace.len() as u64)
}

/// Runs it again and compares every word of every tick.
pub(super) fn run(arguments: &Arguments, trace: &Trace, compiled: &Compiled, ui: &mut Ui) -> Result<(), Failure> {
    let shown = arguments.record.display();
    same_build(arguments, trace.description(), compiled)?;
    let mut machine = Supervised::new(sim::emitted(compiled, ui)?).map_err(sim::environment)?;
    let description = trace.description();
    if machine.input_names() != description.input_names || machine.output_names() != description.output_names {
        return Err(Failure::Gate(format!(
            "{shown} has no words of supervised ticks; a record of rt-pc is expected, or of a target (`.rec`)"
        )));
    }
    ui.progress("running the record again");
    machine.reset();
    let (inputs, outputs) = (description.input_names.len(), description.output_names.len());
    let mut output = vec![0; outputs];
    let mut difference = None;
    for (tick, row) in trace.rows().enumerate() {
        machine.step(&row[..inputs], &mut output);
        let digest = machine.digest();
        if row[inputs..inputs + outputs] != output || row[inputs + outputs] != digest {
            let mut recorded = Trace::new(description.clone());
            recorded.push(&row[..inputs], &row[inputs..inputs + outputs], row[inputs + outputs]);
            let mut replayed = Trace::new(description.clone());
            replayed.push(&row[..inputs], &output, digest);
            let what = first_difference(&recorded, &replayed).map_or_else(String::new, |found| found.to_string());
            difference = Some((tick, what));
            break;
        }
    }
    let result = json!({
        "ticks": trace.len(),
        "bit_equal": difference.is_none() && !trace.is_empty(),
        "first_difference": difference.as_ref().map(|(tick, what)| json!({ "tick": tick, "what": what })),
    });
    let head = format!(
        "{shown}: {}\n  {} ticks from power-up; every output and digest of the machine compared\n",
        compiled.ir.name,
        trace.len()
    );
    let message = match difference {
        None if !trace.is_empty() => {
            ui.result(&format!("{head}  bit-equal\n"), result);
            return Ok(());
        }
        None => "there is no tick in it; record again".to_owned(),
        Some((tick, what)) => {
            format!("the first tick that differs is number {tick} of the record (host a is the record): {what}")
        }
    };
    if !ui.is_json() {
        ui.out(&head);
    }
    Err(Failure::Judged { message: format!("{shown}: {message}"), result })
}
