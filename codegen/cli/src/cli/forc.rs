//! `specgen forc`: simulates the reversal-curve experiment on a leg outside the controller's model class, or writes only its
//! drive signal for a waveform generator.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::reversal_curves::Curves;
use specgen_studies::reversal_curves::Experiment;

use super::identify::range;
use super::number::number;
use super::path_roles::{InputFile, TableFile};
use super::plot::Plot;
use super::sim::PlantArguments;

/// Arguments of `forc`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::FORC)]
pub struct Arguments {
    /// Simulate a leg of this spec, with its stroke, voltages, amplifier and gauge noise; the reference leg if not given. The
    /// records named by the spec need not exist.
    spec: Option<InputFile>,
    /// Output file: CSV with time_s, drive_V, displacement_um; no displacement with --drive-only.
    #[arg(short, long, value_name = "FILE")]
    output: TableFile,
    /// Number of reversal curves, and of cells per axis of the grid to identify; that of the spec, or 32, if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=256))]
    grid: Option<u32>,
    /// Slope of the drive, V/s; a fifth of the voltage range per second if not given. `identify rate` needs records at several
    /// rates.
    #[arg(long, value_name = "V/S", allow_negative_numbers = true, value_parser = number("", "a slope from 0.1 to 100000 V/s", 0.1..=1e5))]
    rate: Option<f64>,
    /// Write three records: the curves, 4 curves at 32 times the rate (leg-fast.csv for -o leg.csv) and 10 s of random drive
    /// (leg-arbitrary.csv). From these `identify` separates creep from rate dependence.
    #[arg(long)]
    two_rates: bool,
    /// Write only the drive signal, for a waveform generator: 0 V to the lowest voltage, one second there, then the curves.
    #[arg(long, conflicts_with_all = ["plot", "seed", "no_noise"])]
    drive_only: bool,
    /// Voltage range of --drive-only, such as -90:90; that of the spec, or 0:100, if not given.
    #[arg(long, value_name = "MIN:MAX", value_parser = range, allow_hyphen_values = true, requires = "drive_only")]
    drive: Option<[f64; 2]>,
    /// Sampling rate of --drive-only, Hz.
    #[arg(long, value_name = "HZ", requires = "drive_only", default_value_t = 10_000.0, value_parser = number("", "1 to 1000000 samples per second", 1.0..=1e6), allow_negative_numbers = true)]
    sampling: f64,
    #[command(flatten)]
    plot: Plot,
    #[command(flatten)]
    plant: PlantArguments,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Arguments { output, grid, rate, drive, sampling, plant, .. } = arguments;
    let (grid, rate, spec) = (*grid, *rate, arguments.spec.as_deref());
    let two_rates = arguments.two_rates;
    let PlantArguments { seed, no_noise, .. } = *plant;
    let curves = if arguments.drive_only {
        let experiment = Experiment { grid, rate, two_rates, ..Experiment::default() };
        Curves::of_drives(&experiment.drives(spec, *drive, *sampling)?, output)?
    } else {
        let experiment = Experiment { grid, rate, seed, no_noise, two_rates, shape: plant.options().leg()? };
        Curves::of(&experiment.records(spec)?, output, &arguments.plot.place())?
    };
    ui.result(&curves);
    Ok(())
}
