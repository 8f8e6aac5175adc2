//! `specgen panel`: shows and operates a machine in the browser.

use std::net::SocketAddr;

use clap::{ArgGroup, Args};
use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::panel;
use specgen_report::panel::{facts, html};

use super::line::Line;
use super::path_roles::InputFile;

/// Arguments of `panel`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("line").required(true).args(["port", "socket"])), after_help = super::examples::PANEL)]
pub struct Arguments {
    /// The spec that the device was built from. It provides the drawing of the platform and the margins of gains.
    #[arg(value_name = "SPEC")]
    spec: InputFile,
    #[command(flatten)]
    line: Line,
    /// Address for browsers. Unless it is local to this computer, anyone on the network who knows the token can move the
    /// machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8020")]
    listen: SocketAddr,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec_file::looked_up(&arguments.spec, ui)?;
    interrupt::heed();
    let digest = compiled.ir.digest.clone();
    let open = || arguments.line.open(Some(&digest));
    let (session, name) = open()?;
    let mut facts = facts(&compiled.model, compiled.design.as_ref());
    for (key, value) in panel::device_facts(&session, &name, &compiled)? {
        facts[key] = value;
    }
    let page = html(&format!("{}: panel", compiled.model.name), &facts);
    ui.result(&panel::serve(session, || Ok(open()?.0), &name, compiled, arguments.listen, page, ui)?);
    Ok(())
}
