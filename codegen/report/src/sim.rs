//! Runs a spec's controller on simulated machines outside its model class: motions of the user's own platform, or the
//! paper's experiments.

mod legs;
mod platform;
mod record;

use std::path::PathBuf;

use specgen_compiler::compile::Compilation;
use specgen_language::outcome::Failure;
use specgen_language::output::{check_place, claim};
use specgen_language::ui::Ui;
use specgen_studies::controllers::{self, Interruptible};
use specgen_studies::machine::PlantOptions;

use crate::drawing::{self, File, Plot};

pub use legs::chart as chart_of_legs;
pub use platform::chart as chart_of_platform;

/// Options of `sim`.
#[derive(Debug)]
pub struct Options {
    /// Folder of the tables.
    pub output: Option<PathBuf>,
    /// Write every tick of every run.
    pub traces: bool,
    /// Plot of the errors.
    pub plot: Plot,
    /// The paper's experiments.
    pub paper: bool,
    /// The machine.
    pub plant: PlantOptions,
    /// Control ticks per period of a motion of legs.
    pub samples: Option<u32>,
    /// Frequencies of the motions, Hz.
    pub frequency: Option<Vec<f64>>,
    /// A single trajectory of the spec.
    pub trajectory: Option<String>,
    /// Delay of the voltages in control intervals.
    pub latency: u32,
    /// Simulate the machine in steps of 20 µs.
    pub small_steps: bool,
    /// File of a record, instead of experiments.
    pub record: Option<PathBuf>,
    /// Use the emitted controller.
    pub emitted: bool,
    /// Length of the record, s.
    pub seconds: f64,
    /// Amplitude of the record's third axis, or of each leg, relative to its free range.
    pub amplitude: f64,
}

/// Default frequencies of motions, Hz.
const FREQUENCIES: [f64; 2] = [1.0, 10.0];

impl Options {
    fn frequencies(&self) -> &[f64] {
        self.frequency.as_deref().unwrap_or(&FREQUENCIES)
    }
}

/// Writes tables, and traces if requested; reports the size of the traces first.
fn write_files(options: &Options, tables: Vec<File>, traces: Vec<File>, ui: &Ui) -> Result<(), Failure> {
    let Some(folder) = &options.output else { return Ok(()) };
    let mut files = tables;
    if options.traces {
        let megabytes = traces.iter().map(|(_, bytes)| bytes.len()).sum::<usize>() as f64 / 1e6;
        ui.progress(&format!("writing {} traces, {megabytes:.1} MB, to {}", traces.len(), folder.display()));
        files.extend(traces);
    }
    drawing::write(folder, &files, ui)
}

/// Simulates a spec, writes the requested files and shows the result.
///
/// # Errors
/// The options do not fit the spec, a run fails, or a file cannot be written.
pub fn run(options: &Options, compiled: &Compilation, ui: &mut Ui) -> Result<(), Failure> {
    let task = compiled.model.task_space.as_ref();
    match task {
        Some(task) => platform::check(options, task)?,
        None => legs::check(options, compiled)?,
    }
    options.plot.wanted()?;
    // Refuses an unusable folder before a long run.
    let _claimed = options.output.as_deref().map(claim).transpose()?;
    options.record.as_deref().map_or(Ok(()), check_place)?;
    let controller = controllers::chosen(compiled, options.emitted, ui)?;
    if let Some(path) = &options.record {
        return record::run(options, path, compiled, controller, ui);
    }
    let mut controller = Interruptible(controller);
    match task {
        Some(task) => platform::run(options, compiled, task, &mut controller, ui),
        None => legs::run(options, compiled, &mut controller, ui),
    }
}
