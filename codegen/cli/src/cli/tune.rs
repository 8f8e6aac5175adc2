//! `specgen tune`: tunes gains and weights on the simulated loop with the controller of the spec.

use clap::{Args, ValueEnum};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::tune::{self, Options};
use specgen_studies::tuning::TunedNumbers;
use specgen_studies::tuning::space::GivenBounds;

use super::number::number;
use super::path_roles::{InputFile, OutputFolder};
use super::plot::Plot;
use super::sim::{PlantArguments, frequency};

/// Arguments of `tune`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::TUNE)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Parameters to tune; those that the spec's control mode does not use are left out.
    #[arg(long, value_enum, default_value = "all")]
    what: WhatArgument,
    /// Optimiser.
    #[arg(long, value_enum, default_value = "cma")]
    optimiser: OptimiserArgument,
    /// Also run the genetic algorithm with as many candidates, and keep the better result.
    #[arg(long)]
    compare: bool,
    /// Total number of candidates; 5000 for a platform (50 generations of 100) or 1000 for legs if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    evaluations: Option<u32>,
    /// Candidates per generation; 100 (Table 3) for the genetic algorithm or 20 for CMA-ES if not given.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(4..=100_000))]
    population: Option<u32>,
    /// Trajectory used for tuning. The result is also scored on one that tuning did not use: case-1 (without [control]: leg),
    /// or multisine if that one was used for tuning.
    #[arg(long, value_enum, default_value = "multisine")]
    trajectory: TrajectoryArgument,
    /// Highest frequency of the multisine, or operating frequency of the paper's trajectory, Hz.
    #[arg(long, value_name = "HZ", default_value = "10", value_parser = frequency, allow_negative_numbers = true)]
    frequency: f64,
    /// Length of the multisine, s.
    #[arg(long, value_name = "S", default_value = "2", value_parser = number("", "a time from 0.01 to 1000 s", 0.01..=1000.0), allow_negative_numbers = true)]
    seconds: f64,
    /// Factor on all gains and bandwidths at which a candidate must still be stable.
    #[arg(long, default_value = "2", value_parser = number("", "a factor from 1 to 20", 1.0..=20.0), allow_negative_numbers = true)]
    gain_margin: f64,
    /// Additional delay, in ticks, at which a candidate must still be stable; for a spec with [control].
    #[arg(long, default_value = "0.5", value_parser = number("", "a number of ticks from 0 to 5", 0.0..=5.0), allow_negative_numbers = true)]
    delay_margin: f64,
    /// Bounds of a parameter group, such as `ki=10:1000`: kp, ki (1/s) and kv (s), relative to the stiffness of the axis; level and
    /// drift: rad/s with [control], otherwise weights per tick.
    #[arg(long, value_name = "GROUP=LOW:HIGH", value_parser = bounds)]
    bounds: Vec<GivenBounds>,
    /// With [control]: extra delay from controller to amplifiers, in ticks (control periods).
    #[arg(long, default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=100))]
    latency: u32,
    /// Number of worker threads; one per processor if not given. The result does not depend on it.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Only score the candidates in this file, for your own optimiser: a JSON array of objects that map parameter names to
    /// numbers, in the units of --bounds. Omitted parameters keep the spec's value. `[]` prints names and bounds.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["optimiser", "compare", "evaluations", "population", "output", "write", "plot"])]
    evaluate: Option<InputFile>,
    /// Folder for the Pareto front, the history, the report and the plot.
    #[arg(short, long, value_name = "DIR")]
    output: Option<OutputFolder>,
    /// Write the result into the spec. Without it, the change is printed as a patch.
    #[arg(long)]
    write: bool,
    #[command(flatten)]
    plot: Plot,
    #[command(flatten)]
    plant: PlantArguments,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum WhatArgument {
    Gains,
    Weights,
    All,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum OptimiserArgument {
    /// CMA-ES.
    Cma,
    /// The paper's genetic algorithm, Table 3.
    Genetic,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum TrajectoryArgument {
    /// Smooth motion.
    Multisine,
    /// The multisine with a zigzag instead of its fastest sine; its corners make the platform ring.
    Zigzag,
    Leg,
    #[value(name = "case-1")]
    Case1,
    #[value(name = "case-2")]
    Case2,
    Machining,
}

fn bounds(text: &str) -> Result<GivenBounds, String> {
    let parsed = text.split_once('=').and_then(|(group, range)| {
        let (low, high) = range.split_once(':')?;
        Some(GivenBounds {
            group: group.trim().to_owned(),
            bounds: [low.trim().parse().ok()?, high.trim().parse().ok()?],
        })
    });
    parsed.ok_or_else(|| format!("expected GROUP=LOW:HIGH such as ki=10:1000, found `{text}`"))
}

fn name(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let options = options!(arguments => Options {
        compare evaluations population frequency seconds gain_margin delay_margin bounds latency threads write;
        spec: arguments.spec.to_path_buf(), genetic: arguments.optimiser == OptimiserArgument::Genetic,
        trajectory: name(arguments.trajectory), evaluate: arguments.evaluate.as_deref().map(Into::into),
        output: arguments.output.as_deref().map(Into::into), plot: arguments.plot.place(),
        plant: arguments.plant.options(),
        what: match arguments.what {
            WhatArgument::Gains => TunedNumbers::Gains,
            WhatArgument::Weights => TunedNumbers::Weights,
            WhatArgument::All => TunedNumbers::All,
        },
    });
    tune::run(&options, ui)
}
