//! `specgen export`: the controller as a C library, a Python module or an FMU.

use clap::{Args, Subcommand};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::export;

use super::named::{InputFile, OutputFolder};

/// Arguments of `export`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPORT)]
pub struct Arguments {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand, Debug)]
enum Kind {
    /// A C header, the library for this host, and two sources that use them: `tick.c` for firmware, `example.c` that runs it.
    #[command(after_help = super::examples::EXPORT)]
    C(Folder),
    /// The library for this host, and a module that steps it in any Python, without the package `specgen` or numpy.
    #[command(after_help = super::examples::EXPORT_PYTHON)]
    Python(Folder),
    /// FMI 2.0 co-simulation units of the controller under its supervisor and of the simulated machine, sources included.
    Fmu(FmuArguments),
}

/// Arguments of `export c` and `export python`.
#[derive(Args, Debug)]
struct Folder {
    /// The spec file.
    spec: InputFile,
    /// Folder for the library and what uses it.
    #[arg(short, long, value_name = "DIR")]
    output: OutputFolder,
}

/// Arguments of `export fmu`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPORT_FMU)]
struct FmuArguments {
    /// The spec file.
    spec: InputFile,
    /// Folder for the units, which are called after the platform.
    #[arg(short, long, value_name = "DIR")]
    output: OutputFolder,
    /// Write the simulated machine of `specgen sim`, too, as NAME_plant.fmu.
    #[arg(long)]
    plant: bool,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    match &arguments.kind {
        Kind::C(Folder { spec, output }) => export::c(spec, output, ui),
        Kind::Python(Folder { spec, output }) => export::python(spec, output, ui),
        Kind::Fmu(FmuArguments { spec, output, plant }) => export::fmu::run(spec, output, *plant, ui),
    }
}
