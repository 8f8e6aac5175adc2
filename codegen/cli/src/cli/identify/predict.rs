//! `specgen identify predict`: a table or a spec and a drive in, the displacement out, beside the measured one where there is one.

use std::fmt::Write as _;
use std::path::Path;

use clap::Args;

use super::cause::account;
use super::reading::ReadingArguments;
use super::{Identified, Measured, refused};
use crate::cli::named::{InputFile, OutputFile};
use crate::cli::plot::{Plot, wrote};
use crate::cli::spec;
use specgen_identify::mode::{self, Mode};
use specgen_identify::rate::{Inertia, RateModel};
use specgen_identify::{Drive, Prediction, declared, predict, read_drive, read_file, read_table_csv};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::ui::Ui;
use specgen_report::identification as figure;

/// Arguments of `identify predict`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::PREDICT)]
pub struct Arguments {
    /// A table as `specgen identify -o` writes it, or a spec (.toml): the tables of its records, with its creep, second weight and
    /// dead time.
    #[arg(value_name = "TABLE|SPEC")]
    model: InputFile,
    /// Drive: CSV with time_s, drive_V (the command) or monitor_V (the measured voltage); compared if it has displacement_um.
    drive: InputFile,
    /// Leg of the spec, 0 to 5.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=5), allow_negative_numbers = true)]
    leg: u8,
    /// Time by which the displacement lags the voltage, ms; that of the spec, or none, if not given.
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    dead_time: Option<f64>,
    /// Resonance behind the model, frequency in Hz and damping ratio, such as 735:0.015, or `none`; if not given that of the
    /// spec, or with a table that of a ring in the record.
    #[arg(long, value_name = "HZ:ZETA", value_parser = mode)]
    mode: Option<Given>,
    /// Write time_s, drive_V, displacement_um (predicted) and, where it was measured, measured_um and error_um here.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
    #[command(flatten)]
    reading: ReadingArguments,
    #[command(flatten)]
    plot: Plot,
}

/// Up to the 10 ms that `hysteresis.dead_time` may be; in s.
fn milliseconds(text: &str) -> Result<f64, String> {
    let expected = || format!("expected milliseconds from 0 to 10, found `{text}`");
    text.parse::<f64>().ok().filter(|ms| (0.0..=10.0).contains(ms)).map(|ms| ms * 1e-3).ok_or_else(expected)
}

/// A mode, or that there is none.
#[derive(Debug, Clone, Copy)]
struct Given(Option<Mode>);

fn mode(text: &str) -> Result<Given, String> {
    if text == "none" {
        return Ok(Given(None));
    }
    let found = text.split_once(':').and_then(|(hz, zeta)| Some((hz.parse::<f64>().ok()?, zeta.parse::<f64>().ok()?)));
    match found {
        Some((frequency, damping)) if (0.1..=1e7).contains(&frequency) && damping > 0.0 && damping < 1.0 => {
            Ok(Given(Some(Mode { frequency, damping })))
        }
        _ => Err(format!(
            "expected FREQUENCY:DAMPING, a frequency in Hz and a damping ratio below 1, or none; found `{text}`"
        )),
    }
}

/// What a mode adds: that given, else that of the model, else that of a ring in the record.
fn inertia(arguments: &Arguments, model: &RateModel, drive: &Drive) -> Option<Inertia> {
    let ring = || mode::ring(&drive.time, &drive.drive, drive.displacement.as_ref()?).map(|ring| ring.mode);
    let found = match (arguments.mode, model.inertia) {
        (Some(Given(mode)), _) => mode,
        (None, Some(own)) => Some(own.mode),
        (None, None) => ring(),
    };
    found.map(|mode| Inertia { mode, gain: model.still.mean_gain() })
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let shown = arguments.drive.display().to_string();
    let drive = read_drive(&arguments.drive, &shown, &arguments.reading.reading()?).map_err(refused)?;
    let mut model = model(&arguments.model, usize::from(arguments.leg), ui)?;
    // In a spec it counts from the voltage; a command is held on its way there.
    model.dead_time = arguments.dead_time.unwrap_or(model.dead_time) + drive.held;
    model.inertia = inertia(arguments, &model, &drive);
    let prediction = predict(&model, &drive).map_err(refused)?;
    if let Some(output) = &arguments.output {
        write_file(output, csv(&prediction).as_bytes())?;
    }
    let plot = arguments.plot.write("Prediction", || figure::prediction(&prediction))?;
    let files = arguments.output.as_ref().map(|path| wrote(path)).into_iter().chain(plot).collect();
    ui.result(&Identified { record: shown, report: prediction, measured: Measured::of(&[], false), files });
    Ok(())
}

fn model(path: &Path, leg: usize, ui: &mut Ui) -> Result<RateModel, Failure> {
    if path.extension().is_some_and(|extension| extension == "toml") {
        let model = spec::model(path)?;
        let dir = path.parent().unwrap_or(Path::new(""));
        let declared = declared::records(&model, dir).map_err(refused)?;
        ui.findings(None, &declared.warnings);
        return declared
            .leg(&model, leg)
            .ok_or_else(|| Failure::Usage(format!("`{}` names no record in hysteresis.records", path.display())));
    }
    let shown = path.display().to_string();
    let text = read_file(path, &shown).map_err(refused)?;
    Ok(RateModel::of_table(read_table_csv(&text, &shown).map_err(refused)?, 0.0))
}

/// Numbers are the shortest that read back.
fn csv(prediction: &Prediction) -> String {
    let measured = prediction.measured.as_ref();
    let mut text = String::from("time_s,drive_V,displacement_um");
    text += if measured.is_some() { ",measured_um,error_um\n" } else { "\n" };
    for (k, y) in prediction.displacement.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = write!(text, "{:?},{:?},{:?}", prediction.time[k], prediction.drive[k], y * 1e6);
        let _ = match measured {
            Some(measured) => writeln!(text, ",{:?},{:?}", measured[k] * 1e6, (measured[k] - y) * 1e6),
            None => writeln!(text),
        };
    }
    text
}

/// What stands behind the name of the record: how well it was predicted.
pub(super) fn summary(prediction: &Prediction) -> String {
    let start = format!("start: {:.0} % of the open weight on", prediction.start_on * 100.0);
    let Some(compared) = &prediction.compared else {
        return format!("{} samples predicted; the file has no displacement_um to compare with", prediction.time.len());
    };
    let clipped = match prediction.samples_clipped {
        0 => String::new(),
        clipped => format!("; {clipped} samples outside the table's range are held at its end"),
    };
    format!(
        "predicted to {:.3} % rms, {:.3} % at worst, of {:.3} µm ({start}{clipped})\n  this residual: {}",
        compared.rms_percent,
        compared.max_percent,
        compared.range * 1e6,
        account(&compared.cause)
    )
}

impl Outcome for Identified<Prediction> {
    fn text(&self) -> String {
        let report = &self.report;
        let mut text = format!("{}: {}\n", self.record, summary(report));
        let _ = write!(
            text,
            "  displacement {:.3} ms behind the drive column; {} samples before the drive moves are left out",
            report.dead_time * 1e3,
            report.samples_skipped
        );
        if let Some(inertia) = report.inertia {
            let _ =
                write!(text, "\n  mode at {:.1} Hz, damping ratio {:.4}", inertia.mode.frequency, inertia.mode.damping);
        }
        if report.compared.is_none() && report.samples_clipped > 0 {
            let _ = write!(text, "; {} samples outside the table's range are held at its end", report.samples_clipped);
        }
        text + "\n" + &self.files
    }
}
