//! `specgen identify response`.

use std::fmt::Write as _;
use std::path::Path;

use super::{Bench, IdentificationResult, MeasuredKeys, refused};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;

use crate::identification as figure;
use specgen_identify::response::{self, Estimate, ResponseReport};

/// Reads the record, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(record: &Path, segment: Option<usize>, bench: &Bench, ui: &mut Ui) -> Result<(), Failure> {
    let shown = record.display().to_string();
    let report = response::respond(record, &shown, segment, &bench.reading).map_err(refused)?;
    ui.findings(None, &report.warnings);
    let files = bench.plot.write("Frequency response", || figure::response(&report))?.unwrap_or_default();
    let keys = ["actuator.resonance", "actuator.damping_ratio", "amplifier.lag"];
    let measured = MeasuredKeys::of(&keys, report.simulated);
    ui.result(&IdentificationResult { record: shown, report, measured, files });
    Ok(())
}

impl Outcome for IdentificationResult<ResponseReport> {
    fn text(&self) -> String {
        let Self { record, report, measured, files } = self;
        let f = &report.fitted;
        let shown_in = |e: Estimate, scale: f64| format!("{:.4} ± {:.1e}", e.value * scale, e.error * scale);
        let mut text = format!(
            "{record}: {} segments of {} samples at {:.1} Hz, bins of {:.3} Hz, used {:.3} to {:.1} Hz, coherence {:.4} in the middle, misfit {:.2} %\n",
            report.segments,
            report.segment,
            report.rate,
            report.resolution,
            report.band[0],
            report.band[1],
            report.coherence,
            report.misfit_percent
        );
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "  resonance     {} Hz\n  damping ratio {}\n  lag           {} ms\n  dead time     {} ms (including half a period of converter hold)\n  lag + dead    {} ms (correlation of the two errors {:.2})\n  static gain   {:.6} ± {:.1e} µm/V\n",
            shown_in(f.resonance, 1.0),
            shown_in(f.damping_ratio, 1.0),
            shown_in(f.lag, 1e3),
            shown_in(f.dead_time, 1e3),
            shown_in(f.lag_and_dead_time, 1e3),
            f.lag_dead_time_correlation,
            f.gain.value * 1e6,
            f.gain.error * 1e6,
        );
        let _ = write!(
            text,
            "spec lines:\n[actuator]\nresonance = \"{:.1} Hz\"  # static gain here: {:.5} um/V for small amplitude, below that of a large loop\ndamping_ratio = {:.4}\n[amplifier]\nlag = \"{:.4} ms\"\n{}{files}",
            f.resonance.value,
            f.gain.value * 1e6,
            f.damping_ratio.value,
            f.lag.value * 1e3,
            measured.text()
        );
        text
    }
}
