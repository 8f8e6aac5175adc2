//! `specgen dynamics`: M, C ḣ, G, J and leg forces of a platform at given states, with the controller's model.

use clap::Args;
use specgen_identify::Reading;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::dynamics;

use super::path_roles::{InputFile, OutputFile};

/// Arguments of `dynamics`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::DYNAMICS)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// States, in m, rad and s: JSON (a list of objects with `h`, `hd`, `hdd`, or an object with such a list as `vectors`), or
    /// CSV with a header line and 18 columns (pose, rate, acceleration).
    #[arg(long, value_name = "FILE")]
    states: InputFile,
    /// Columns of a CSV file, given by header or number (from 1), with units, scale and offset, such as
    /// 'x_um=2,vx=3*5 um/s/V', in any order. If not given, they are found by their names, or by their places.
    #[arg(long, value_name = "NAME=COLUMN,…")]
    columns: Vec<String>,
    /// Poses are relative to the rest pose. Without this option, z is measured from the base frame.
    #[arg(long)]
    from_rest: bool,
    /// Compute with the scalar type and constants of the controller, instead of its model at full precision.
    #[arg(long)]
    generated: bool,
    /// Write the result (JSON) here instead of printing it.
    #[arg(short, long, value_name = "FILE")]
    output: Option<OutputFile>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Arguments { spec, states, columns, from_rest, generated, output } = arguments;
    let reading = Reading::new(columns, None).map_err(|why| Failure::Usage(format!("--columns: {why}")))?;
    dynamics::run(spec, states, &reading, *from_rest, *generated, output.as_deref(), ui)
}
