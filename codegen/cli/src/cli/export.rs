//! `specgen export`: the controller as a C library, a Python module or an FMU; tables in other forms.

use clap::{Args, Subcommand};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_report::arrays;
use specgen_studies::export;

use super::path_roles::{InputFile, OutputFolder, TableFile};

/// Arguments of `export`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPORT)]
pub struct Arguments {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand, Debug)]
enum Kind {
    /// A C header, the library for this host, and two example sources: `tick.c` for firmware, and `example.c`, which calls it.
    #[command(after_help = super::examples::EXPORT)]
    C(Folder),
    /// The library for this host, and a Python module that steps it. It needs neither the package `specgen` nor numpy.
    #[command(after_help = super::examples::EXPORT_PYTHON)]
    Python(Folder),
    /// FMI 2.0 co-simulation units (FMUs) of the supervised controller and of the simulated machine, with their sources.
    Fmu(FmuArguments),
    /// A table that specgen wrote, in another form: CSV, .npz (NumPy) or .mat (MATLAB 7), by the suffix of the output.
    Table(TableArguments),
}

/// Arguments of `export c` and `export python`.
#[derive(Args, Debug)]
struct Folder {
    /// The spec file.
    spec: InputFile,
    /// Folder for the library and its sources.
    #[arg(short, long, value_name = "DIR")]
    output: OutputFolder,
}

/// Arguments of `export fmu`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPORT_FMU)]
struct FmuArguments {
    /// The spec file.
    spec: InputFile,
    /// Folder for the FMUs, which are named after the platform.
    #[arg(short, long, value_name = "DIR")]
    output: OutputFolder,
    /// Also write the simulated machine of `specgen sim`, as NAME_plant.fmu.
    #[arg(long)]
    plant: bool,
}

/// Arguments of `export table`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::EXPORT_TABLE)]
struct TableArguments {
    /// A table: CSV as specgen writes it, such as a trace of `specgen sim -o`, or a file of arrays.
    table: InputFile,
    /// The new file, with an array for each column.
    #[arg(short, long, value_name = "FILE")]
    output: TableFile,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    match &arguments.kind {
        Kind::C(Folder { spec, output }) => export::c(spec, output, ui),
        Kind::Python(Folder { spec, output }) => export::python(spec, output, ui),
        Kind::Table(TableArguments { table, output }) => arrays::run(table, output, ui),
        Kind::Fmu(FmuArguments { spec, output, plant }) => export::fmu::run(spec, output, *plant, ui),
    }
}
