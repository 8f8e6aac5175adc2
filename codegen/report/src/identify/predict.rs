//! `specgen identify predict`: predicts the displacement for a drive from a table, the lines of a leg or a spec, and compares it with a measured one if available.

use crate::drawing::wrote;
use std::path::{Path, PathBuf};

use super::cause::account;
use super::{Bench, IdentificationResult, MeasuredKeys, refused};
use crate::identification as figure;
use specgen_compiler::spec_file;
use specgen_identify::mode::{self, Mode};
use specgen_identify::rate::{Inertia, RateModel};
use specgen_identify::{Drive, Input, Prediction, declared, predict, read_drive, read_file, read_leg_csv};
use specgen_language::outcome::{Failure, Outcome, Refusal};
use specgen_language::output::write_table;
use specgen_language::spec::{SpecSource, leg_lines};
use specgen_language::ui::Ui;

/// Options of `predict`.
#[derive(Debug)]
pub struct Options {
    /// A table, the lines of a leg, or a spec.
    pub model: PathBuf,
    /// The drive, and the measured displacement if any.
    pub drive: PathBuf,
    /// Leg of the spec.
    pub leg: u8,
    /// Lag of the displacement, s.
    pub dead_time: Option<f64>,
    /// The mode to add to the model, or `Some(None)` for no mode.
    pub mode: Option<Option<Mode>>,
    /// Output file of the prediction.
    pub output: Option<PathBuf>,
}

/// The contribution of a mode: the given one, else the model's, else one fitted to ringing in the record.
fn inertia(options: &Options, model: &RateModel, drive: &Drive) -> Option<Inertia> {
    let ring = || mode::ring(&drive.time, &drive.drive, drive.displacement.as_ref()?).map(|ring| ring.mode);
    let gain = model.inertia.map_or_else(|| model.reversal_gain(), |own| own.gain);
    let found = match (options.mode, model.inertia) {
        (Some(mode), _) => mode,
        (None, Some(own)) => Some(own.mode),
        (None, None) => ring(),
    };
    found.map(|mode| Inertia { mode, gain })
}

/// Reads the files, predicts, writes the requested files and shows the result.
///
/// # Errors
/// A file cannot be read or written, or its data are unsuitable.
pub fn run(options: &Options, bench: &Bench, ui: &mut Ui) -> Result<(), Failure> {
    let shown = options.drive.display().to_string();
    let drive = read_drive(Input::File(&options.drive, &bench.reading), &shown).map_err(refused)?;
    ui.findings(None, &drive.warnings);
    let mut model = model(&options.model, usize::from(options.leg), ui)?;
    // A spec's dead time counts from the voltage; a command is held before that.
    model.dead_time = options.dead_time.unwrap_or(model.dead_time) + drive.held;
    model.inertia = inertia(options, &model, &drive);
    let prediction = predict(&model, &drive).map_err(refused)?;
    if let Some(output) = &options.output {
        write_table(output, csv(&prediction).as_bytes())?;
    }
    let plot = bench.plot.write("Prediction", || figure::prediction(&prediction))?;
    let files = options.output.as_ref().map(|path| wrote(path)).into_iter().chain(plot).collect();
    ui.result(&IdentificationResult { report: prediction, measured: MeasuredKeys::of(&[], false), files });
    Ok(())
}

fn model(path: &Path, leg: usize, ui: &mut Ui) -> Result<RateModel, Failure> {
    if path.extension().is_some_and(|extension| extension == "toml") {
        let dir = path.parent().unwrap_or(Path::new(""));
        let source = SpecSource::read(path).map_err(|finding| Refusal { source: None, findings: vec![finding] })?;
        if let Some(lines) = leg_lines(&source) {
            let lines = lines.map_err(|findings| Refusal { source: Some(source), findings })?;
            return declared::of_lines(&lines, dir, leg).map_err(refused);
        }
        let model = spec_file::model(path)?;
        let declared = declared::records(&model, dir).map_err(refused)?;
        ui.findings(None, &declared.warnings);
        return declared.leg(&model, leg).ok_or_else(|| {
            Failure::Usage(format!("`{}` has no records in hysteresis.records: no leg is identified", path.display()))
        });
    }
    let shown = path.display().to_string();
    let text = read_file(path, &shown).map_err(refused)?;
    Ok(RateModel::of_leg(read_leg_csv(&text, &shown).map_err(refused)?))
}

/// Numbers have the shortest form that reads back exactly.
fn csv(prediction: &Prediction) -> String {
    let measured = prediction.measured.as_ref();
    let mut text = String::from("time_s,drive_V,displacement_um");
    text += if measured.is_some() { ",measured_um,error_um\n" } else { "\n" };
    for (k, y) in prediction.displacement.iter().enumerate() {
        text += &format!("{:?},{:?},{:?}", prediction.time[k], prediction.drive[k], y * 1e6);
        if let Some(measured) = measured {
            text += &format!(",{:?},{:?}", measured[k] * 1e6, (measured[k] - y) * 1e6);
        }
        text.push('\n');
    }
    text
}

/// Text after the name of the record: quality of the prediction.
pub fn summary(prediction: &Prediction) -> String {
    let start = format!("start: {:.0} % of the open weight on", prediction.start_on * 100.0);
    let Some(compared) = &prediction.compared else {
        return format!(
            "{} samples predicted; the file has no displacement_um for a comparison",
            prediction.time.len()
        );
    };
    let clipped = match prediction.samples_clipped {
        0 => String::new(),
        clipped => format!("; {clipped} samples clamped to the table's range"),
    };
    let (rms, most, range) = (compared.rms_percent, compared.max_percent, compared.range * 1e6);
    let cause = account(&compared.cause);
    format!(
        "prediction error {rms:.3} % rms, at most {most:.3} %, of {range:.3} µm ({start}{clipped})\n  residual: {cause}"
    )
}

impl Outcome for IdentificationResult<Prediction> {
    fn text(&self) -> String {
        let report = &self.report;
        let mut text = format!("{}: {}\n", report.record, summary(report));
        let (delay, skipped) = (report.dead_time * 1e3, &report.samples_skipped);
        text += &format!(
            "  displacement delayed by {delay:.3} ms relative to the drive column; {skipped} samples before the drive moves are ignored"
        );
        if let Some(inertia) = report.inertia {
            let Inertia { mode: Mode { frequency, damping }, gain } = inertia;
            text += &format!("\n  mode at {frequency:.1} Hz, damping ratio {damping:.4}, gain {:.5} µm/V", gain * 1e6);
        }
        if report.compared.is_none() && report.samples_clipped > 0 {
            text += &format!("; {} samples clamped to the table's range", report.samples_clipped);
        }
        text + "\n" + &self.files
    }
}
