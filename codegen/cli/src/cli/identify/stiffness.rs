//! `specgen identify stiffness`.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::plot::Plot;
use super::refused;
use crate::cli::ui::{Failure, Ui};

use specgen_identify::stiffness;
use specgen_report::identification as figure;

/// Arguments of `identify stiffness`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::STIFFNESS)]
pub struct Arguments {
    /// CSV with columns time_s, force_N (positive where it pushes the displacement up), displacement_um, and drive_V if
    /// there is one, which must be constant.
    record: PathBuf,
    #[command(flatten)]
    plot: Plot,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let shown = arguments.record.display().to_string();
    let report = stiffness::measure(&arguments.record, &shown).map_err(refused)?;
    ui.findings(None, &report.warnings);
    let creep = report.creep_time.map_or_else(
        || "no creep found".to_owned(),
        |t| format!("creep of {:.2} % with {t:.3} s taken out", report.creep_percent),
    );
    let text = format!(
        "{shown}: k = {:.4} ± {:.4} N/µm (standard error); {creep}, drift {:.3} nm/s; without these corrections {:.4} N/µm\n  {} samples ({:.0} independent), force {:.3} N to {:.3} N, residual {:.3} nm rms\nlines for the spec:\n[actuator]\naxial_stiffness = \"{:.4e} N/m\"\n",
        report.stiffness * 1e-6,
        report.error * 1e-6,
        report.drift * 1e9,
        report.uncorrected * 1e-6,
        report.samples,
        report.independent,
        report.force[0],
        report.force[1],
        report.residual_rms * 1e9,
        report.stiffness
    );
    let plot = arguments.plot.write("Stiffness", || figure::stiffness(&report))?;
    ui.result(&format!("{text}{plot}"), json!({ "report": report }));
    Ok(())
}
