//! `specgen report`: writes an HTML report about a spec, or about a run of its machine.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::pages::{self, Options};

use super::path_roles::{InputFile, OutputFile};

/// Arguments of `report`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::REPORT)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Output file; `<name>-report.html` if not given.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
    /// Also write `<output>-paper.html`, with the paper's figures and tables.
    #[arg(long)]
    paper: bool,
    /// With --paper: generations of the genetic algorithm, 100 candidates each; 0 to skip it.
    #[arg(long, default_value_t = 10, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    generations: u32,
    /// Report about this recorded run instead, compared with a simulation of the same commands.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["paper", "no_target"])]
    record: Option<InputFile>,
    /// Build nothing and skip the emulated microcontroller: no time, memory or bit comparison.
    #[arg(long)]
    no_target: bool,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let options = options!(arguments => Options {
        paper generations no_target;
        spec: arguments.spec.to_path_buf(), output: arguments.output.as_deref().map(Into::into),
        record: arguments.record.as_deref().map(Into::into),
    });
    pages::run(&options, ui)
}
