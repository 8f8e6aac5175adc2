//! `specgen replay`: a recording run again on the host, tick by tick, by bits.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::replay;

use super::named::{InputFile, OutputFile};
use super::plot::Plot;

/// Arguments of `replay`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::REPLAY)]
pub struct Arguments {
    /// The recording: from a target, from `specgen sim --record` or from `rt-pc --record`.
    recording: InputFile,
    /// The spec that the target was built from. Without it the recording can only be exported.
    #[arg(long, value_name = "SPEC", required_unless_present_any = ["csv", "mcap"])]
    spec: Option<InputFile>,
    /// Write the recording as CSV, with time and units; with --spec also volts, and of a platform pose, target and error.
    #[arg(long, value_name = "FILE")]
    csv: Option<OutputFile>,
    /// Write the recording as MCAP, a channel a signal, JSON with schemas: gauges, codes, status, phase, settings; with --spec
    /// also what --csv has.
    #[arg(long, value_name = "FILE")]
    mcap: Option<OutputFile>,
    /// With --spec: build the emitted controller and replay on that, which needs Rust. Without it the same law runs on the constants
    /// of the compiled spec, with the same bits.
    #[arg(long, requires = "spec")]
    emitted: bool,
    /// With --spec: target less pose, or demand less gauge of the legs.
    #[command(flatten)]
    plot: Plot,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Arguments { recording, spec, csv, mcap, emitted, plot } = arguments;
    let spec = spec.as_deref().map(|spec| (spec, *emitted));
    replay::run(recording, spec, csv.as_deref(), mcap.as_deref(), &plot.place(), ui)
}
