//! `specgen doctor`: whether this computer can run a controller in real time, and what to change.

use clap::Args;

use super::path_roles::InputFile;
use super::plot::Plot;
use specgen_compiler::spec_file;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::doctor::{self, Grade};
use specgen_report::chart::{Axis, Chart, LINE};

/// Period of the measurement without a spec, ns: 10 kHz.
const PERIOD: u64 = 100_000;

/// Arguments of `doctor`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::DOCTOR)]
pub struct Arguments {
    /// A spec whose control period the computer must keep. The default period is 100 µs.
    spec: Option<InputFile>,
    /// Duration of the wake-up measurement, s.
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Measure on this processor.
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    #[command(flatten)]
    plot: Plot,
}

fn seconds(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a time from 0.1 to 86400 s, found `{text}`");
    text.parse().ok().filter(|time| (0.1..=86_400.0).contains(time)).ok_or_else(expected)
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let mut period = PERIOD;
    if let Some(spec) = &arguments.spec {
        let compiled = spec_file::looked_up(spec, ui)?;
        period = (compiled.model.timing.period * 1e9) as u64;
    }
    let report = doctor::examine(period, arguments.seconds, arguments.cpu, ui)?;
    let counts = report.latency.below_ns.iter().filter(|(_, count)| *count > 0);
    let chart =
        Chart::new("", "late wake-ups", Axis::log("later than planned, below", "µs"), Axis::log("how many", "")).with(
            "",
            LINE,
            counts.map(|(below, count)| [*below as f64 / 1e3, *count as f64]).collect(),
        );
    if let Some(line) = arguments.plot.place().charts("wake-ups of this computer", &report.verdict.text, &[chart])? {
        ui.progress(line.trim_end());
    }
    // Without a spec there is no requirement to fail.
    let failed = (report.verdict.grade == Grade::Bad && arguments.spec.is_some()).then(|| report.verdict.text.clone());
    ui.judged(&report, failed)
}
