//! `specgen check`: reports every finding about a spec, and writes nothing.

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::check;

use super::path_roles::InputFile;

/// Arguments of `check`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::CHECK)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Also print the properties of the controller: assumed values, margins, reach, limits of the wiring check.
    #[arg(long)]
    details: bool,
    #[command(flatten)]
    strictness: super::Strictness,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    check::run(&arguments.spec, arguments.details, arguments.strictness.deny_warnings, ui)
}
