//! `specgen identify`: turns measured records into tables, lines of a spec, figures and plots.
//!
//! `specgen identify RECORD` identifies the Everett table, or refits the legs if the record is a recorded run; the other
//! kinds are subcommands. A record with the name of a subcommand is given as `./linear`.

use clap::{Arg, Args, Subcommand};
use specgen_identify::mode::Mode;
use specgen_identify::{DeadTime, Reading, size};
use specgen_language::model::LegModelKind;
use specgen_language::outcome::Failure;
use specgen_language::output::check_table;
use specgen_language::ui::Ui;
use specgen_report::identify::{Bench, cross_talk, estimates, everett, gains, linear, predict, rate, refit};

use super::number::number;
use super::path_roles::{InputFile, OutputFileOrFolder, OutputFolder, TableFile};
use super::plot::Plot;

/// Arguments of `identify`.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "specgen identify [OPTIONS] --drive <MIN:MAX> <RECORD>...\n       specgen identify [OPTIONS] --spec <SPEC> <RUN.rec>\n       specgen identify <COMMAND>",
    after_help = super::examples::IDENTIFY,
    mut_arg("series", table)
)]
pub struct Arguments {
    #[command(subcommand)]
    kind: Option<Kind>,
    #[command(flatten)]
    everett: EverettArguments,
}

#[derive(Subcommand, Debug)]
enum Kind {
    /// Gain ρ of a leg at several frequencies (Y = ρX + δ), its ratio λ to the gain at the lowest one, and adaptation weights that
    /// are stable for every λ found.
    Linear(LinearArguments),
    /// Frequency response from a swept sine, multisine or noise: resonance, damping, lag, dead time.
    Response(ResponseArguments),
    /// Gain of each leg of a platform relative to its table, from a recorded run; writes six corrected tables.
    Gains(GainsArguments),
    /// Cross-talk of the legs of an assembled platform, from six records of `specgen operate … watch`, each with one leg
    /// driven.
    CrossTalk(CrossTalkArguments),
    /// Calibration of a gauge from its voltage and a reference.
    Gauge(GaugeArguments),
    /// Displacement that a table or a spec predicts for a drive, compared with the measured one.
    Predict(PredictArguments),
    /// Axial stiffness from force and displacement at constant drive.
    Stiffness(StiffnessArguments),
    /// Compare rate-dependent models on records of one leg at several rates.
    Rate(RateArguments),
}

/// Arguments of `identify RECORD`.
#[derive(Args, Debug)]
struct EverettArguments {
    /// Reversal-curve record (CSV, MATLAB, HDF5, TDMS, NumPy) with columns time_s, drive_V, displacement_um; further ones
    /// of the same leg, at other rates, are fitted together with it. With --spec: a recorded run of a platform, from which
    /// gain, delay and cubic nonlinearity of each leg are fitted again.
    #[arg(required = true, value_name = "RECORD")]
    records: Vec<InputFile>,
    /// Voltage range of the table, V, such as 0:100 or -90:90.
    #[arg(long, value_name = "MIN:MAX", value_parser = range, allow_hyphen_values = true)]
    drive: Option<[f64; 2]>,
    /// The spec of the controller that made the recorded run; gives the voltage range and the grid.
    #[arg(long, value_name = "SPEC", conflicts_with_all = ["drive", "grid", "dead_time", "model", "validate", "columns", "rate", "series", "max_size", "plot"])]
    spec: Option<InputFile>,
    /// Cells per axis of the Preisach grid; chosen by cross-validation over whole curves if not given.
    #[arg(long, value_name = "N", value_parser = grid, allow_negative_numbers = true)]
    grid: Option<usize>,
    /// Dead time from the drive column to the displacement, ms; estimated if not given and the record shows it.
    #[arg(long, value_name = "MS", value_parser = number("", "milliseconds from 0 to 10", 0.0..=10.0), allow_negative_numbers = true)]
    dead_time: Option<f64>,
    /// Leg model: preisach, bouc-wen, generalized-plays, plays, bouc-wen-plays; or auto: one of these, chosen by
    /// cross-validation or by the error on --validate.
    #[arg(long, value_name = "MODEL", value_parser = model, default_value = "preisach")]
    model: LegModelKind,
    /// Another record of the leg, not used in the fit, on which the error of the result is computed. With --model auto it
    /// selects the model: the simplest whose error on it is within 10 % of the smallest.
    #[arg(long, value_name = "RECORD")]
    validate: Option<InputFile>,
    /// Write the table to this file (CSV: up_V, down_V, everett_um). With --spec: a folder for six tables, leg0.csv to
    /// leg5.csv, inside the folder of the spec.
    #[arg(short, long, value_name = "FILE|DIR")]
    output: Option<OutputFileOrFolder>,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of `identify linear`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LINEAR, mut_arg("series", table))]
struct LinearArguments {
    /// Records at one frequency each: CSV with columns time_s, drive_V, displacement_um. The drive may be the output of an
    /// inverse hysteresis model, as in the paper.
    #[arg(required = true)]
    records: Vec<InputFile>,
    /// Frequencies of the records, Hz, in the same order; estimated from the records if not given.
    #[arg(long, value_name = "HZ,…", value_delimiter = ',', value_parser = number("Hz", "a frequency in Hz above zero", 1e-6..=1e6))]
    frequency: Vec<f64>,
    /// Frequency of the model's gain ρ̂, Hz; the lowest one if not given.
    #[arg(long, value_name = "HZ", value_parser = number("Hz", "a frequency in Hz above zero", 1e-6..=1e6))]
    reference: Option<f64>,
    /// Check whether the weights of this spec are stable over the identified λ, on its sampled loop.
    #[arg(long, value_name = "SPEC")]
    spec: Option<InputFile>,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of `identify response`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::RESPONSE, mut_arg("series", table))]
struct ResponseArguments {
    /// Swept sine, multisine or noise: CSV with columns time_s, drive_V, displacement_um, evenly sampled.
    record: InputFile,
    /// Samples per segment; a power of two near an eighth of the record if not given.
    #[arg(long, value_name = "N")]
    segment: Option<usize>,
    /// Write the response to this file, a table (see `specgen export table`): frequency_Hz, real_um_per_V,
    /// imaginary_um_per_V, coherence.
    #[arg(short, long, value_name = "FILE")]
    output: Option<TableFile>,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of `identify gains`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::GAINS)]
struct GainsArguments {
    /// Recording of a run in which every leg moves slowly over much of its stroke, such as a wave on all axes.
    recording: InputFile,
    /// The spec of the controller that made the recording.
    #[arg(long, value_name = "SPEC")]
    spec: InputFile,
    /// Folder for the six tables, leg0.csv to leg5.csv, inside the folder of the spec.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
}

/// Arguments of `identify cross-talk`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::CROSS_TALK)]
struct CrossTalkArguments {
    /// Files that `watch` wrote, for legs 0 to 5 in order. In each, that leg alone makes three raised-cosine strokes of 20 V,
    /// 0.5 s each.
    #[arg(required = true, value_name = "RECORD")]
    records: Vec<InputFile>,
}

/// Arguments of `identify gauge`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::GAUGE)]
struct GaugeArguments {
    /// CSV with columns gauge_V and reference_um, and optionally time_s.
    record: InputFile,
    /// Degree of the polynomial, 1 to 5; chosen by cross-validation if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=5))]
    degree: Option<u8>,
    /// Write the calibration table to this file, for other programs (CSV: gauge_V, reference_um, means over even steps).
    #[arg(long, value_name = "FILE")]
    table: Option<TableFile>,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of `identify predict`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::PREDICT, mut_arg("series", table))]
struct PredictArguments {
    /// The model: a table written by `specgen identify -o`, a spec (.toml), with its tables, rate tables, creep and dead time, or
    /// the lines of one leg that `identify rate -o` writes.
    #[arg(value_name = "TABLE|SPEC")]
    model: InputFile,
    /// Drive: CSV with time_s and drive_V (the command) or monitor_V (the measured voltage). With displacement_um, the
    /// prediction is compared with it.
    drive: InputFile,
    /// Leg of the spec, 0 to 5.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=5), allow_negative_numbers = true)]
    leg: u8,
    /// Dead time from voltage to displacement, ms; that of the spec, or 0, if not given.
    #[arg(long, value_name = "MS", value_parser = number("", "milliseconds from 0 to 10", 0.0..=10.0), allow_negative_numbers = true)]
    dead_time: Option<f64>,
    /// Resonance in series with the model, as frequency in Hz and damping ratio, such as 735:0.015, or `none`. If not given, that
    /// of the spec; with a table, estimated from ringing in the record.
    #[arg(long, value_name = "HZ:ZETA", value_parser = mode)]
    mode: Option<ModeArgument>,
    /// Write time_s, drive_V, displacement_um (predicted) and, if measured, measured_um and error_um to this file.
    #[arg(short, long, value_name = "FILE")]
    output: Option<TableFile>,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of `identify stiffness`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::STIFFNESS, mut_arg("series", table))]
struct StiffnessArguments {
    /// CSV with columns time_s, force_N (positive if it increases the displacement), displacement_um, and optionally drive_V,
    /// which must be constant.
    record: InputFile,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of `identify rate`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::RATE, mut_arg("series", table))]
struct RateArguments {
    /// At least two records of one leg at different rates: CSV with columns time_s, drive_V, displacement_um.
    #[arg(required = true, value_name = "RECORD")]
    records: Vec<InputFile>,
    /// Voltage range of the tables, V, such as 0:100 or -90:90.
    #[arg(long, value_name = "MIN:MAX", value_parser = range, allow_hyphen_values = true)]
    drive: [f64; 2],
    /// Cells per axis of the Preisach grid.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = grid, allow_negative_numbers = true)]
    grid: usize,
    /// Another record, not used in any fit, to compare the options.
    #[arg(long, value_name = "RECORD")]
    hold_out: Option<InputFile>,
    /// Write NAME.toml (lines of a spec) and the tables NAME-static.csv, NAME-mu0.csv and so on.
    #[arg(short, long, value_name = "NAME")]
    output: Option<OutputFolder>,
    #[command(flatten)]
    bench: BenchArguments,
}

/// Arguments of every kind of record.
#[derive(Args, Debug)]
struct BenchArguments {
    /// Map columns, given by header or number (from 1), to names with units, such as drive_mV=Voltage,time_s=1, or with a
    /// scale and an offset, as in 'displacement=CH2*5 um/V+0.3 um'. If not given, columns are found by their headers.
    #[arg(long, value_name = "NAME=COLUMN,…")]
    columns: Vec<String>,
    /// Sampling rate, Hz: time is computed from the column `sample`, or else from row numbers.
    #[arg(long, value_name = "HZ", value_parser = number("Hz", "samples per second above zero", 1e-3..=1e9), allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Which table of a file to read, by number (from 1) or name; the longest if not given.
    #[arg(long, value_name = "N|NAME")]
    series: Option<String>,
    /// Largest size in memory of a compressed or binary record, such as 500MB or 4GB. Each number takes 8 bytes.
    #[arg(long, value_name = "SIZE", value_parser = size, default_value = "2GB")]
    max_size: u64,
    #[command(flatten)]
    plot: Plot,
}

impl BenchArguments {
    fn bench(&self) -> Result<Bench, Failure> {
        let reading = Reading::new(&self.columns, self.rate);
        let reading = reading.map_err(|why| Failure::Usage(format!("--columns: {why}")))?;
        let reading = reading.of_series(self.series.clone()).with_max_size(self.max_size);
        Ok(Bench { reading, plot: self.plot.place() })
    }
}

/// `--series` is also `--table`, except for `gauge`, which writes one.
fn table(series: Arg) -> Arg {
    series.visible_alias("table")
}

/// Plausible voltages; `actuator.voltage` of a spec has the same range.
const VOLTS: std::ops::RangeInclusive<f64> = -1e4..=1e4;

pub(super) fn range(text: &str) -> Result<[f64; 2], String> {
    let expected = || format!("expected two voltages LOW:HIGH in V, found `{text}`");
    let (low, high) = text.split_once(':').ok_or_else(expected)?;
    let number = |part: &str| part.trim().trim_end_matches('V').trim().parse::<f64>().map_err(|_| expected());
    let (low, high) = (number(low)?, number(high)?);
    if ![low, high].iter().all(|volts| VOLTS.contains(volts)) {
        Err(format!("expected voltages from {} to {} V, found `{text}`", VOLTS.start(), VOLTS.end()))
    } else if low < high {
        Ok([low, high])
    } else {
        Err(format!("the lower voltage must be below the upper one, found `{text}`"))
    }
}

/// Any whole number: identification checks which sizes are possible.
fn grid(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("expected a whole number, found `{text}`"))
}

/// A family of leg models.
pub(super) fn model(text: &str) -> Result<LegModelKind, String> {
    LegModelKind::of_word(text).ok_or_else(|| format!("expected {}, found `{text}`", LegModelKind::words()))
}

/// A mode, or none.
#[derive(Debug, Clone, Copy)]
struct ModeArgument(Option<Mode>);

fn mode(text: &str) -> Result<ModeArgument, String> {
    if text == "none" {
        return Ok(ModeArgument(None));
    }
    let found = text.split_once(':').and_then(|(hz, zeta)| Some((hz.parse::<f64>().ok()?, zeta.parse::<f64>().ok()?)));
    match found {
        Some((frequency, damping)) if (0.1..=1e7).contains(&frequency) && damping > 0.0 && damping < 1.0 => {
            Ok(ModeArgument(Some(Mode { frequency, damping })))
        }
        _ => Err(format!(
            "expected FREQUENCY:DAMPING, a frequency in Hz and a damping ratio below 1, or none; found `{text}`"
        )),
    }
}

/// `words` are those of the command line.
pub fn run(arguments: &Arguments, words: &[String], ui: &mut Ui) -> Result<(), Failure> {
    match &arguments.kind {
        Some(Kind::Linear(LinearArguments { records, frequency, reference, spec, bench })) => {
            linear::run(records, frequency, *reference, spec.as_deref(), &bench.bench()?, ui)
        }
        Some(Kind::Response(ResponseArguments { record, segment, output, bench })) => {
            estimates::response(record, *segment, output.as_deref(), &bench.bench()?, ui)
        }
        Some(Kind::Gains(GainsArguments { recording, spec, output })) => {
            gains::run(recording, spec, output.as_deref(), ui)
        }
        Some(Kind::CrossTalk(CrossTalkArguments { records })) => {
            let records: Vec<_> = records.iter().map(|record| record.to_path_buf()).collect();
            cross_talk::run(&records, ui)
        }
        Some(Kind::Gauge(GaugeArguments { record, degree, table, bench })) => {
            estimates::gauge(record, *degree, table.as_deref(), &bench.bench()?, ui)
        }
        Some(Kind::Stiffness(StiffnessArguments { record, bench })) => {
            estimates::stiffness(record, &bench.bench()?, ui)
        }
        Some(Kind::Predict(one)) => {
            let options = predict::Options {
                model: one.model.to_path_buf(),
                drive: one.drive.to_path_buf(),
                leg: one.leg,
                dead_time: one.dead_time.map(|ms| ms * 1e-3),
                mode: one.mode.map(|ModeArgument(mode)| mode),
                output: one.output.as_deref().map(Into::into),
            };
            predict::run(&options, &one.bench.bench()?, ui)
        }
        Some(Kind::Rate(RateArguments { records, drive, grid, hold_out, output, bench })) => {
            rate::run(records, *drive, *grid, hold_out.as_deref(), output.as_deref(), &bench.bench()?, ui)
        }
        None => record(&arguments.everett, words, ui),
    }
}

/// A record without a command: a recorded run, or reversal curves.
fn record(arguments: &EverettArguments, words: &[String], ui: &mut Ui) -> Result<(), Failure> {
    let EverettArguments { records, drive, spec, grid, dead_time, model, validate, output, bench } = arguments;
    let usage = |text: &str| Err(Failure::Usage(text.to_owned()));
    if let Some(spec) = spec {
        return match &records[..] {
            [run] => refit::run(run, spec, output.as_deref(), ui),
            _ => usage("expected one recorded run with --spec: see `specgen identify --help`"),
        };
    }
    if let Some(record) = records.iter().find(|record| refit::is_recorded_run(record)) {
        return usage(&format!(
            "`{}` is a recorded run: give the spec of its target with --spec SPEC",
            record.display()
        ));
    }
    // clap requires a record unless there is a subcommand.
    if records.is_empty() {
        return usage("expected a record: see `specgen identify --help`");
    }
    // A folder in its place is for a recorded run only.
    output.as_deref().map_or(Ok(()), check_table)?;
    let Some(drive) = drive else {
        let given = words.iter().position(|word| word == "identify").map_or(words, |at| &words[at + 1..]);
        return Err(everett::missing_range(records, &bench.bench()?, given, ui));
    };
    let dead_time = dead_time.map_or(DeadTime::Estimate, |ms| DeadTime::Fixed(ms * 1e-3));
    let options = everett::Options { drive: *drive, grid: *grid, dead_time, model: *model };
    everett::run(records, &options, validate.as_deref(), output.as_deref(), &bench.bench()?, ui)
}
