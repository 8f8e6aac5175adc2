//! `specgen gcs`: clients of the General Command Set move a machine over the link.

use std::net::SocketAddr;

use clap::{ArgGroup, Args};
use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::gcs::{self, Axes};

use super::line::Line;
use super::path_roles::InputFile;

/// Arguments of `gcs`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("line").required(true).args(["port", "socket"])), after_help = super::examples::GCS)]
pub struct Arguments {
    /// The spec that the device was built from. A device with another controller is refused.
    #[arg(value_name = "SPEC")]
    spec: Option<InputFile>,
    #[command(flatten)]
    line: Line,
    /// Address for clients. Anyone who can reach it can move the machine: the command set has no password.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:50000")]
    listen: SocketAddr,
    /// Show only the axes (X Y Z U V W) given with this option, each under a name, for clients that support fewer axes. Can be
    /// repeated.
    #[arg(long = "axis", value_name = "NAME=AXIS")]
    axes: Vec<String>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let axes = Axes::parse(&arguments.axes).map_err(|error| Failure::Usage(format!("--axis: {error}")))?;
    let compiled = arguments.spec.as_deref().map(|spec| spec_file::looked_up(spec, ui)).transpose()?;
    let digest = compiled.as_ref().map(|compiled| compiled.ir.digest.as_str());
    interrupt::heed();
    let (session, name) = arguments.line.open(digest)?;
    let alike = compiled.as_ref().map(|compiled| compiled.ir.supervision.alike().to_vec()).unwrap_or_default();
    ui.result(&gcs::serve(session, &name, axes, alike, arguments.listen, ui)?);
    Ok(())
}
