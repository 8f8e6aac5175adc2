//! `specgen replay`: replays a recording on the host and compares every tick bit for bit.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::replay;

use super::path_roles::{InputFile, OutputFile, TableFile};
use super::plot::Plot;

/// Arguments of `replay`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::REPLAY)]
pub struct Arguments {
    /// A recording, from a target, `specgen sim --record` or `rt-pc --record`.
    recording: InputFile,
    /// The spec that the target was built from. Without it, the recording can only be exported.
    #[arg(long, value_name = "SPEC", required_unless_present_any = ["csv", "mcap"])]
    spec: Option<InputFile>,
    /// Export the recording as CSV, with time and units; with --spec also voltages and, for a platform, pose, target and error.
    #[arg(long, value_name = "FILE")]
    csv: Option<TableFile>,
    /// Export the recording as MCAP, with one JSON channel and schema per signal: gauges, codes, status, phase, settings; with
    /// --spec also the signals of --csv.
    #[arg(long, value_name = "FILE")]
    mcap: Option<OutputFile>,
    /// With --spec: build the emitted controller and replay on it, which needs Rust. Without it, the same law runs with the
    /// constants of the compiled spec, and gives the same bits.
    #[arg(long, requires = "spec")]
    emitted: bool,
    /// With --spec: plot target minus pose, or demand minus gauge of the legs.
    #[command(flatten)]
    plot: Plot,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Arguments { recording, spec, csv, mcap, emitted, plot } = arguments;
    let spec = spec.as_deref().map(|spec| (spec, *emitted));
    replay::run(recording, spec, csv.as_deref(), mcap.as_deref(), &plot.place(), ui)
}
