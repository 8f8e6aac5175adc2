//! `specgen panel`: shows and operates a machine in the browser.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{ArgGroup, Args};
use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::commission::{self, Options};
use specgen_operate::panel::{self, Commissioning, Site};
use specgen_report::panel::{facts, html};

use super::commission::run_with_page;
use super::line::Line as LinkArguments;
use super::path_roles::{InputFile, OutputFolder};
use specgen_operate::Line;

/// Arguments of `panel`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("line").required(true).args(["port", "socket"])), after_help = super::examples::PANEL)]
pub struct Arguments {
    /// The spec that the device was built from. It provides the drawing of the platform and the margins of gains.
    #[arg(value_name = "SPEC")]
    spec: InputFile,
    #[command(flatten)]
    line: LinkArguments,
    /// Address for browsers. Unless it is local to this computer, anyone on the network who knows the token can move the
    /// machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8020")]
    listen: SocketAddr,
    /// Let the page in control commission the machine, with records and results in this folder. Only with --socket: the command
    /// has a session of its own.
    #[arg(long, value_name = "DIR", requires = "socket")]
    commission: Option<OutputFolder>,
}

/// The command `commission` for pages, with its usual options.
fn commissioning(arguments: &Arguments, compiled: &Compilation) -> Option<Commissioning> {
    let (folder, socket) = (arguments.commission.as_ref()?.to_path_buf(), arguments.line.socket()?.to_owned());
    let stop = Arc::<AtomicBool>::default();
    let options = Options { yes: true, stop: stop.clone(), ..Options::new(&arguments.spec, &folder) };
    let (compiled, seen) = (compiled.clone(), options.clone());
    let outlook = {
        let compiled = compiled.clone();
        Box::new(move || commission::outlook(&seen, &compiled, true))
    };
    let run = Arc::new(move |ui: &mut Ui| run_with_page(Some(Line::Socket(&socket)), &options, &compiled, ui));
    Some(Commissioning { folder, run, outlook, stop })
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
    let site = Site { listen: arguments.listen, page, commissioning: commissioning(arguments, &compiled) };
    ui.result(&panel::serve(session, || Ok(open()?.0), &name, compiled, site, ui)?);
    Ok(())
}
