//! `specgen design`: designs active damping, gains and bandwidths, and writes them into the spec.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::design;

use super::path_roles::InputFile;

/// Arguments of `design`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::DESIGN)]
pub struct Arguments {
    /// The spec file; the design is written into its `[control.design]`.
    spec: InputFile,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    design::run(&arguments.spec, ui)
}
