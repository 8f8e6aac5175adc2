//! `specgen reproduce`: runs all of the paper's experiments and compares the results with the paper's.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::reproduce;

use super::path_roles::OutputFolder;
use super::plot::Plot;

/// Arguments of `reproduce`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::REPRODUCE)]
pub struct Arguments {
    /// Folder for reproduction.md, reproduction.csv, reproduction.json and convergence.csv.
    #[arg(short, long, value_name = "DIR", default_value = "reproduction")]
    output: OutputFolder,
    /// Generations of the genetic algorithm of Table 3 of the paper, 100 candidates each.
    #[arg(long, default_value_t = 50, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    generations: u32,
    /// Plot the cost of the genetic algorithm by generation.
    #[command(flatten)]
    plot: Plot,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    reproduce::run(&arguments.output, arguments.generations, &arguments.plot.place(), ui)
}
