//! `specgen dynamics`: M, C ḣ, G, J and leg forces of a platform at given states, by the model that its controller uses.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::dynamics;

use super::named::{InputFile, OutputFile};

/// Arguments of `dynamics`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::DYNAMICS)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// States: JSON (a list, or an object with a list `vectors`, of objects with `h`, `hd`, `hdd`), or CSV with a line of
    /// names and 18 columns (pose, rate, acceleration). m, rad, s.
    #[arg(long, value_name = "FILE")]
    states: InputFile,
    /// Poses are from rest; without it their z counts from the base frame.
    #[arg(long)]
    from_rest: bool,
    /// Compute in the scalar of the controller, with its constants, instead of with its model at full precision.
    #[arg(long)]
    generated: bool,
    /// Write the result (JSON) here instead of printing it.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Arguments { spec, states, from_rest, generated, output } = arguments;
    dynamics::run(spec, states, *from_rest, *generated, output.as_deref(), ui)
}
