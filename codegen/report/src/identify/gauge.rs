//! `specgen identify gauge`.

use crate::drawing::wrote;
use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;

use super::{Bench, MeasuredKeys, refused};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::ui::Ui;

use crate::identification as figure;
use specgen_identify::gauge::{self, GaugeReport};

/// Reads the record, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(record: &Path, degree: Option<u8>, table: Option<&Path>, bench: &Bench, ui: &mut Ui) -> Result<(), Failure> {
    let shown = record.display().to_string();
    let report = gauge::calibrate(record, &shown, degree.map(usize::from), &bench.reading).map_err(refused)?;
    ui.findings(None, &report.warnings);
    let mut files = String::new();
    if let Some(path) = table {
        let rows = report.table.iter().fold("gauge_V,reference_um\n".to_owned(), |mut rows, [v, y]| {
            // Writing to a String cannot fail.
            let _ = writeln!(rows, "{v:?},{:?}", y * 1e6);
            rows
        });
        write_file(path, rows.as_bytes())?;
        files += &wrote(path);
    }
    files.extend(bench.plot.write("Gauge calibration", || figure::gauge(&report))?);
    let (calibration, is_given) = (gauge::spec_line(&report), degree.is_some());
    let measured = MeasuredKeys::of(&["sensor.calibration"], report.simulated);
    ui.result(&Calibration { record: shown, is_given, report, calibration, measured, files });
    Ok(())
}

/// Calibration of a gauge.
#[derive(Serialize)]
struct Calibration {
    #[serde(skip)]
    record: String,
    /// The degree was given by the user.
    #[serde(skip)]
    is_given: bool,
    report: GaugeReport,
    calibration: String,
    measured: MeasuredKeys,
    /// One line per written file.
    #[serde(skip)]
    files: String,
}

impl Outcome for Calibration {
    fn text(&self) -> String {
        let report = &self.report;
        let errors: Vec<String> =
            report.held_out_rms.iter().enumerate().map(|(k, e)| format!("{}: {:.3} nm", k + 1, e * 1e9)).collect();
        let chosen = if self.is_given { "given" } else { report.rule };
        let hysteresis = report.hysteresis.map_or_else(
            || "unknown: the reference has no reversal".to_owned(),
            |h| format!("{:.3} nm between the rising and falling branches", h * 1e9),
        );
        format!(
            "{}: {} samples, {:.4} V to {:.4} V, {:.4} µm to {:.4} µm\n  held-out error by degree: {}\n  degree {} ({chosen})\n  \
             residual {:.3} nm rms, at most {:.3} nm (at {})\n  hysteresis {hysteresis}\n  monotonic over these voltages: smallest slope {:.1} % \
             of the mean slope\nspec lines, in [sensor] for all gauges or in [[gauge]] for this one:\n{}\n{}{}",
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
