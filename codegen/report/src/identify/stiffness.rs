//! `specgen identify stiffness`.

use super::{Bench, IdentificationResult, MeasuredKeys, refused};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use std::path::Path;

use crate::identification as figure;
use specgen_identify::stiffness::{self, StiffnessReport};

/// Reads the record, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(record: &Path, bench: &Bench, ui: &mut Ui) -> Result<(), Failure> {
    let shown = record.display().to_string();
    let report = stiffness::measure(record, &shown, &bench.reading).map_err(refused)?;
    ui.findings(None, &report.warnings);
    let files = bench.plot.write("Stiffness", || figure::stiffness(&report))?.unwrap_or_default();
    let measured = MeasuredKeys::of(&["actuator.axial_stiffness"], report.simulated);
    ui.result(&IdentificationResult { record: shown, report, measured, files });
    Ok(())
}

impl Outcome for IdentificationResult<StiffnessReport> {
    fn text(&self) -> String {
        let report = &self.report;
        let creep = report.creep_time.map_or_else(
            || "no creep found".to_owned(),
            |t| format!("creep of {:.2} % with {t:.3} s removed", report.creep_percent),
        );
        format!(
            "{}: k = {:.4} ± {:.4} N/µm (standard error); {creep}, drift {:.3} nm/s; without these corrections {:.4} N/µm\n  \
             {} samples ({:.0} independent), force {:.3} N to {:.3} N, residual {:.3} nm rms\nspec lines:\n[actuator]\n\
             axial_stiffness = \"{:.4e} N/m\"\n{}{}",
            self.record,
            report.stiffness * 1e-6,
            report.error * 1e-6,
            report.drift * 1e9,
            report.uncorrected * 1e-6,
            report.samples,
            report.independent,
            report.force[0],
            report.force[1],
            report.residual_rms * 1e9,
            report.stiffness,
            self.measured.text(),
            self.files
        )
    }
}
