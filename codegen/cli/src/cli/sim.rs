//! `specgen sim`: a spec's controller on simulated machines that are not of its model class: the motions of the user's own
//! platform, or the paper's experiments.

use clap::Args;
use specgen_compiler::spec_file;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::sim::{self as report, Options};
use specgen_studies::machine::PlantOptions;

use super::named::{InputFile, OutputFile, OutputFolder};
use super::number::number;
use super::plot::Plot;

/// Arguments of `sim`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::SIM)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Write tables here; only print without it.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// Write every tick of every run there, too; their size is said first.
    #[arg(long, requires = "output")]
    traces: bool,
    #[command(flatten)]
    plot: Plot,
    /// The paper's experiments, ours beside the paper's, instead of the platform's own motions.
    #[arg(long)]
    paper: bool,
    #[command(flatten)]
    plant: PlantArguments,
    /// Without [control]: control ticks per period of the motion. The spec's period if not given, with --paper 500. The
    /// stability check runs at the resulting interval.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: Option<u32>,
    /// Frequencies of the motions, with --paper of cases 1 and 2, Hz; 1 and 10 if not given. 0.1 takes ten times as long as 1.
    #[arg(long, value_name = "HZ", value_delimiter = ',', value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<Vec<f64>>,
    /// With [control]: play this trajectory of the spec on board, and nothing else.
    #[arg(long, value_name = "NAME", conflicts_with = "paper")]
    trajectory: Option<String>,
    /// With [control]: delay of the voltages to the amplifiers, in control intervals.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=100))]
    latency: u32,
    /// With [control]: simulate the machine in steps of 20 µs instead of one step per control interval, as a check of the result.
    /// Several times slower.
    #[arg(long, conflicts_with = "record")]
    small_steps: bool,
    /// Instead of the experiments: a wave on all axes under the supervisor, every tick of it recorded in this file for
    /// `specgen replay`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["output", "plot", "paper", "samples", "frequency", "trajectory"])]
    record: Option<OutputFile>,
    /// Build the emitted controller and run that, which needs Rust. Without it the same law runs on the constants of the compiled
    /// spec, with the same bits.
    #[arg(long)]
    emitted: bool,
    /// Length of that wave, s.
    #[arg(long, value_name = "S", default_value_t = 1.0, requires = "record", allow_negative_numbers = true)]
    seconds: f64,
}

/// A frequency at which a trajectory has a sensible length.
pub(super) fn frequency(text: &str) -> Result<f64, String> {
    number("Hz", "a frequency from 0.001 to 1000 Hz", 1e-3..=1e3)(text)
}

/// Which leg is simulated.
#[derive(Args, Debug)]
pub struct PlantArguments {
    /// Hysteresis model of the simulated legs, scaled to the legs of the spec: `plays` (default), `bouc-wen`, or a file of leg
    /// parameters (JSON). The paper's experiments with six legs use it unscaled.
    #[arg(long, value_name = "LEG")]
    pub(super) plant: Option<InputFile>,
    /// Without noise and quantisation of gauge and amplifier.
    #[arg(long)]
    pub(super) no_noise: bool,
    /// Seed of the noise, and with [control] of the tolerances of the machine.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub(super) seed: u64,
}

impl PlantArguments {
    pub(super) fn options(&self) -> PlantOptions {
        PlantOptions { plant: self.plant.as_deref().map(Into::into), no_noise: self.no_noise, seed: self.seed }
    }
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let plant = arguments.plant.options();
    // A bad plant file is refused before the minutes of the rest.
    plant.leg()?;
    let compiled = spec_file::compiled(&arguments.spec, ui)?;
    let options = Options {
        output: arguments.output.as_deref().map(Into::into),
        traces: arguments.traces,
        plot: arguments.plot.place(),
        paper: arguments.paper,
        plant,
        samples: arguments.samples,
        frequency: arguments.frequency.clone(),
        trajectory: arguments.trajectory.clone(),
        latency: arguments.latency,
        small_steps: arguments.small_steps,
        record: arguments.record.as_deref().map(Into::into),
        emitted: arguments.emitted,
        seconds: arguments.seconds,
    };
    report::run(&options, &compiled, ui)
}
