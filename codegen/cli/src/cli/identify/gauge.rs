//! `specgen identify gauge`.

use std::fmt::Write as _;

use clap::Args;
use serde::Serialize;

use super::reading::ReadingArguments;
use super::{Measured, refused};
use crate::cli::named::{InputFile, OutputFile};
use crate::cli::plot::{Plot, wrote};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::ui::Ui;

use specgen_identify::gauge::{self, GaugeReport};
use specgen_report::identification as figure;

/// Arguments of `identify gauge`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::GAUGE)]
pub struct Arguments {
    /// CSV with columns gauge_V and reference_um, and time_s if there is one.
    record: InputFile,
    /// Degree of the polynomial, 1 to 5; chosen by cross-validation if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=5))]
    degree: Option<u8>,
    /// Write the calibration as a table (CSV: gauge_V, reference_um, means over even steps) here, for other programs.
    #[arg(long, value_name = "FILE")]
    table: Option<OutputFile>,
    #[command(flatten)]
    reading: ReadingArguments,
    #[command(flatten)]
    plot: Plot,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let shown = arguments.record.display().to_string();
    let report =
        gauge::calibrate(&arguments.record, &shown, arguments.degree.map(usize::from), &arguments.reading.reading()?)
            .map_err(refused)?;
    ui.findings(None, &report.warnings);
    let mut files = String::new();
    if let Some(path) = &arguments.table {
        let rows = report.table.iter().fold("gauge_V,reference_um\n".to_owned(), |mut rows, [v, y]| {
            // Writing to a String cannot fail.
            let _ = writeln!(rows, "{v:?},{:?}", y * 1e6);
            rows
        });
        write_file(path, rows.as_bytes())?;
        files += &wrote(path);
    }
    files.extend(arguments.plot.write("Gauge calibration", || figure::gauge(&report))?);
    let (calibration, is_given) = (gauge::spec_line(&report), arguments.degree.is_some());
    let measured = Measured::of(&["sensor.calibration"], report.simulated);
    ui.result(&Calibration { record: shown, is_given, report, calibration, measured, files });
    Ok(())
}

/// A gauge that was calibrated.
#[derive(Serialize)]
struct Calibration {
    #[serde(skip)]
    record: String,
    /// The degree was not chosen.
    #[serde(skip)]
    is_given: bool,
    report: GaugeReport,
    calibration: String,
    measured: Measured,
    /// A line for each file that was written.
    #[serde(skip)]
    files: String,
}

impl Outcome for Calibration {
    fn text(&self) -> String {
        let report = &self.report;
        let errors: Vec<String> =
            report.held_out_rms.iter().enumerate().map(|(k, e)| format!("{}: {:.3} nm", k + 1, e * 1e9)).collect();
        let chosen = if self.is_given { "as given" } else { report.rule };
        let hysteresis = report.hysteresis.map_or_else(
            || "not known: the reference never turns back".to_owned(),
            |h| format!("{:.3} nm between the ways up and down", h * 1e9),
        );
        format!(
            "{}: {} samples, {:.4} V to {:.4} V, {:.4} µm to {:.4} µm\n  held-out error by degree: {}\n  degree {} ({chosen})\n  \
             residual {:.3} nm rms, {:.3} nm at most (at {})\n  hysteresis {hysteresis}\n  monotonic over these voltages: least slope {:.1} % \
             of the mean slope\nlines for the spec, in [sensor] for all gauges or in [[gauge]] for this one:\n{}\n{}{}",
            self.record,
            report.samples,
            report.volts[0],
            report.volts[1],
            report.reference[0] * 1e6,
            report.reference[1] * 1e6,
            errors.join(", "),
            report.degree,
            report.residual_rms * 1e9,
            report.residual_max * 1e9,
            report.residual_max_at,
            report.least_slope_percent,
            self.calibration,
            self.measured.text(),
            self.files
        )
    }
}
