//! `specgen identify gains`: a recorded run of a platform in; the gain of each leg relative to its table, and six separate tables out.

use std::path::Path;

use serde::Serialize;

use super::recorded_run::{records, records_line, replayed, within, write_tables};
use super::{MeasuredKeys, refused};
use specgen_compiler::spec_file;
use specgen_identify::gains::{self, LegGain};
use specgen_identify::write_table_csv;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::check_input;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;

/// Largest acceptable standard error of λ.
const LARGEST_ERROR: f64 = 0.02;
/// Plausible λ; outside, the spec is wrong or a leg does not follow.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Reads the recording, identifies, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(recording: &Path, spec: &Path, output: Option<&Path>, ui: &mut Ui) -> Result<(), Failure> {
    let shown = recording.display().to_string();
    let refuse = |error: &dyn std::fmt::Display| Failure::Gate(format!("{shown}: {error}"));
    let folder = output.map(|folder| within(spec, folder).map(|name| (name, folder))).transpose()?;
    check_input(recording)?;
    let compiled = spec_file::looked_up(spec, ui)?;
    let model = &compiled.model;
    let tables = records(model, spec, &refuse)?;
    tables.tables_only().map_err(|why| refuse(&why))?;
    let moves = replayed(recording, spec, &compiled, ui)?;
    let simulated = !compiled.assumptions.simulated.is_empty();

    let mut legs = Vec::new();
    for (leg, (voltage, displacement)) in moves.voltages.iter().zip(&moves.displacements).enumerate() {
        let Some(mut own) = tables.leg(model, leg) else { continue };
        own.inertia = None;
        own.dead_time = model.amplifier.lag;
        let name = format!("{shown}, leg {leg}");
        let gain = gains::of(&own, &moves.times, voltage, displacement, &name).map_err(refused)?;
        let gain = gain.filter(|found| found.error <= LARGEST_ERROR && PLAUSIBLE.contains(&found.gain));
        legs.push((own.still, gain.ok_or_else(|| refuse(&poor(leg, gain)))?));
    }
    let (mut files, mut records) = (String::new(), String::new());
    if let Some((name, folder)) = folder {
        let tables = legs.iter().map(|(table, found)| write_table_csv(&gains::scaled(table, found.gain))).collect();
        files = write_tables(folder, tables, simulated)?;
        records = records_line(&name);
    }
    let legs = legs.into_iter().map(|(_, found)| found).collect();
    let measured = MeasuredKeys::of(&["hysteresis.records"], simulated);
    ui.result(&Gains { recording: shown, seconds: moves.seconds(), legs, measured, records, files });
    Ok(())
}

/// Why a run is unsuitable, and how to record a better one.
fn poor(leg: usize, found: Option<LegGain>) -> String {
    let what = found.map_or_else(
        || "does not move enough to determine a gain".to_owned(),
        |found| format!("has the gain {:.3} ± {:.3}", found.gain, found.error),
    );
    format!(
        "leg {leg} {what}: record at least a second of a slow wave on all axes, as large as the workspace permits, in closed loop \
         and without contact"
    )
}

/// Identified gains.
#[derive(Serialize)]
struct Gains {
    #[serde(skip)]
    recording: String,
    /// Duration in which the law moved the legs, s.
    seconds: f64,
    /// In leg order.
    legs: Vec<LegGain>,
    measured: MeasuredKeys,
    #[serde(skip)]
    records: String,
    #[serde(skip)]
    files: String,
}

impl Outcome for Gains {
    fn text(&self) -> String {
        let mut text =
            format!("{}: gains of legs 0 to 5 relative to their tables, from {:.3} s\n", self.recording, self.seconds);
        let columns = [5, 9, 11, 11, 13, 15].map(|width| right(width).behind(" "));
        row(&mut text, &columns, &[&"leg", &"lambda", &"± std err", &"travel µm", &"error nm rms", &"with λ = 1"]);
        for (leg, found) in self.legs.iter().enumerate() {
            let [gain, error] = [found.gain, found.error].map(|value| format!("{value:.4}"));
            let [after, before] = [found.residual_rms, found.residual_before].map(|rms| format!("{:.1}", rms * 1e9));
            let travel = format!("{:.3}", found.travel * 1e6);
            row(&mut text, &columns, &[&leg, &gain, &error, &travel, &after, &before]);
        }
        if !self.records.is_empty() {
            text += &format!("lines for the spec:\n[hysteresis]\n{}\n{}", self.records, self.measured.text());
        }
        text + &self.files
    }
}
