//! `specgen forc`: the experiment that records reversal curves, on a simulated leg that is not of the controller's model class;
//! or its drive alone, for a generator.

use std::fmt::Write as _;

use clap::Args;
use host_sim::forc::{ReversalExperiment, ReversalRecord, trimmed};
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};
use serde::Serialize;
use specgen_language::model::Model;
use specgen_report::chart::{Axis, Chart, LINE};
use specgen_studies::machine;

use super::identify::range;
use super::named::{InputFile, OutputFile};
use super::plot::Plot;
use super::sim::PlantArguments;
use super::spec;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::ui::Ui;

/// Curves where nothing else is said.
const CURVES: u32 = 32;
/// Time in which the drive crosses its range, s.
const CROSSING: f64 = 5.0;

/// Arguments of `forc`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::FORC)]
pub struct Arguments {
    /// Simulate a leg of this spec: its stroke, voltages, amplifier and gauge noise. Without it, the reference leg. The records
    /// that the spec names need not be there.
    spec: Option<InputFile>,
    /// File to write: CSV with time_s, drive_V, displacement_um; without displacement for --drive-only.
    #[arg(short, long, value_name = "FILE")]
    output: OutputFile,
    /// Reversal curves, and cells per axis of the grid that they identify; 32, or the grid of the spec.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=256))]
    grid: Option<u32>,
    /// Slope of the drive, V/s; a fifth of the voltage range if not given. Records at several rates are what `identify rate`
    /// needs.
    #[arg(long, value_name = "V/S", allow_negative_numbers = true, value_parser = slope)]
    rate: Option<f64>,
    /// Write the drive alone, for a generator: from 0 V to the lowest voltage, a second there, then the curves.
    #[arg(long, conflicts_with_all = ["plot", "seed", "no_noise"])]
    drive_only: bool,
    /// Voltages of --drive-only, such as -90:90; those of the spec, or 0:100, if not given.
    #[arg(long, value_name = "MIN:MAX", value_parser = range, allow_hyphen_values = true, requires = "drive_only")]
    drive: Option<[f64; 2]>,
    /// Samples per second of --drive-only, Hz.
    #[arg(long, value_name = "HZ", requires = "drive_only", default_value_t = 10_000.0, value_parser = sampling, allow_negative_numbers = true)]
    sampling: f64,
    #[command(flatten)]
    plot: Plot,
    #[command(flatten)]
    plant: PlantArguments,
}

/// Slopes from one sweep in hours to one in milliseconds.
fn slope(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a slope from 0.1 to 100000 V/s, found `{text}`");
    text.parse().ok().filter(|rate| (0.1..=1e5).contains(rate)).ok_or_else(expected)
}

fn sampling(text: &str) -> Result<f64, String> {
    let expected = || format!("expected 1 to 1000000 samples per second, found `{text}`");
    text.parse().ok().filter(|rate| (1.0..=1e6).contains(rate)).ok_or_else(expected)
}

/// The record of reversal curves that was written.
#[derive(Serialize)]
struct Curves {
    rows: usize,
    file: String,
    /// The line about it.
    #[serde(skip)]
    plot: Option<String>,
}

/// The loops of a record.
fn chart(record: &ReversalRecord) -> Chart {
    let points = record.rows.iter().map(|row| [row.drive, row.displacement * 1e6]).collect();
    Chart::new("", "hysteresis", Axis::linear("drive", "V"), Axis::linear("displacement", "µm")).with("", LINE, points)
}

impl Outcome for Curves {
    fn text(&self) -> String {
        let plot = self.plot.as_deref().unwrap_or_default();
        format!("wrote {} rows to {}\n{plot}", self.rows, self.file)
    }
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    if arguments.drive_only {
        return drive_alone(arguments, ui);
    }
    let experiment = Experiment {
        grid: arguments.grid,
        rate: arguments.rate,
        seed: arguments.plant.seed,
        no_noise: arguments.plant.no_noise,
        shape: arguments.plant.leg()?,
    };
    let record = match &arguments.spec {
        Some(path) => simulate(&spec::model(path)?, &experiment),
        None => experiment.run(&experiment.shape, CURVES, 0.0),
    };
    let rows = record.rows.len();
    write_file(&arguments.output, record.to_csv().as_bytes())?;
    let plot = arguments.plot.charts("reversal curves", "displacement over drive", &[chart(&record)])?;
    ui.result(&Curves { rows, file: arguments.output.display().to_string(), plot });
    Ok(())
}

/// Samples of a drive for a generator are at most so many.
const MOST_SAMPLES: f64 = 1e7;

/// Writes the drive of the experiment.
fn drive_alone(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let model = arguments.spec.as_deref().map(spec::model).transpose()?;
    let of_spec = model.as_ref().map(|model| (model.actuator.voltage, model.hysteresis.grid as u32));
    let (voltage, grid) = of_spec.unwrap_or(([0.0, 100.0], CURVES));
    let [lowest, highest] = arguments.drive.unwrap_or(voltage);
    let span = highest - lowest;
    let reference = ReversalExperiment::reference(arguments.grid.unwrap_or(grid));
    let rate = arguments.rate.unwrap_or(span / CROSSING);
    let experiment = ReversalExperiment { drive_max: span, rate, ..reference }.sampled(arguments.sampling);
    let rows = experiment.duration() * arguments.sampling;
    if rows > MOST_SAMPLES {
        let most = arguments.sampling * MOST_SAMPLES / rows;
        return Err(Failure::Usage(format!(
            "the drive goes on for {:.0} s, {rows:.1e} samples at {} Hz: give --sampling {:.0}, or a higher --rate",
            experiment.duration(),
            arguments.sampling,
            most.floor()
        )));
    }
    let drive = experiment.drive(lowest, 1.0);
    let rows = drive.len();
    let mut text = String::from("time_s,drive_V\n");
    for (k, u) in drive.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{},{}", trimmed(k as f64 / arguments.sampling, 8), trimmed(*u, 6));
    }
    write_file(&arguments.output, text.as_bytes())?;
    ui.result(&Curves { rows, file: arguments.output.display().to_string(), plot: None });
    Ok(())
}

/// How a leg is recorded.
pub struct Experiment {
    grid: Option<u32>,
    rate: Option<f64>,
    seed: u64,
    no_noise: bool,
    /// What a spec does not say of a leg: the shape of its hysteresis, its creep.
    shape: LegParameters,
}

impl Default for Experiment {
    fn default() -> Self {
        Self { grid: None, rate: None, seed: 1, no_noise: false, shape: LegParameters::reference() }
    }
}

impl Experiment {
    /// Records `leg`, whose lowest voltage is `lowest`, V.
    fn run(&self, leg: &LegParameters, curves: u32, lowest: f64) -> ReversalRecord {
        let noise = if self.no_noise { NoiseParameters::NONE } else { leg.noise };
        let reference = ReversalExperiment::reference(self.grid.unwrap_or(curves));
        let rate = self.rate.unwrap_or(leg.u_max / CROSSING);
        let experiment = ReversalExperiment { drive_max: leg.u_max, rate, ..reference };
        let mut record = experiment.run(&mut LegPlant::new(leg), &mut Gauge::new(&noise, self.seed, 0));
        record.rows.iter_mut().for_each(|row| row.drive += lowest);
        record
    }
}

/// A record of a leg as `model` describes it.
pub fn simulate(model: &Model, experiment: &Experiment) -> ReversalRecord {
    let leg = machine::leg(model, &experiment.shape);
    // At most `MAX_GRID`.
    experiment.run(&leg, model.hysteresis.grid as u32, model.actuator.voltage[0])
}
