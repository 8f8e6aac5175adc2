//! `specgen identify cross-talk`: six records of `watch` in; E of the assembled platform out, as a line of the spec.
use std::path::PathBuf;

use specgen_identify::cross_talk::{CrossTalk, of_records};
use specgen_language::files;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;

use super::{IdentificationResult, MeasuredKeys, refused};

/// Reads the records of legs 0 to 5, identifies and shows the result.
///
/// # Errors
/// There are not six files, one cannot be read, or its data are unsuitable.
pub fn run(records: &[PathBuf], ui: &mut Ui) -> Result<(), Failure> {
    let read = |path: &PathBuf| {
        let shown = path.display().to_string();
        let text = files::text(path).map_err(|unread| Failure::Gate(format!("{shown}: {unread}")))?;
        Ok((shown, text))
    };
    let texts: Vec<(String, String)> = records.iter().map(read).collect::<Result<_, Failure>>()?;
    let texts = texts.try_into().map_err(|_| {
        Failure::Usage(format!("expected six records, of legs 0 to 5 in order; found {}", records.len()))
    })?;
    let report = of_records(&texts).map_err(refused)?;
    let measured = MeasuredKeys::of(&["actuator.cross_talk"], report.simulated);
    ui.result(&IdentificationResult { report, measured, files: String::new() });
    Ok(())
}

impl Outcome for IdentificationResult<CrossTalk> {
    fn text(&self) -> String {
        let Self { report: CrossTalk { matrix, error, travel, residual_rms, .. }, measured, .. } = self;
        let [least, most] = [f64::min, f64::max].map(|of| travel.iter().copied().reduce(of).unwrap_or_default() * 1e6);
        let largest = matrix.iter().flatten().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
        let mut text = format!(
            "legs 0 to 5 moved by {least:.2} to {most:.2} µm each; largest entry {largest:.2e} ± {error:.0e} (standard error), residual {:.2} nm rms\n\
             spec lines:\n[actuator]\ncross_talk = [\n",
            residual_rms * 1e9
        );
        for row in matrix {
            let row: Vec<String> = row.iter().map(|entry| format!("{entry:.3e}")).collect();
            text += &format!("    [{}],\n", row.join(", "));
        }
        text + "]\n" + &measured.text()
    }
}
