//! `specgen gcs`: programs that speak the General Command Set move a machine over the link.

use std::net::{SocketAddr, TcpListener};

use clap::{ArgGroup, Args};
use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_operate::gcs::{Axes, Bridge, Stage};

use super::line::Line;
use super::named::InputFile;
use super::operate::{Operator, Served};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;

/// Arguments of `gcs`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("line").required(true).args(["port", "socket"])), after_help = super::examples::GCS)]
pub struct Arguments {
    /// The spec that the device was built from; another controller is then refused.
    #[arg(value_name = "SPEC")]
    spec: Option<InputFile>,
    #[command(flatten)]
    line: Line,
    /// Where clients connect. Whoever can reach it can move the machine: the command set knows no password.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:50000")]
    listen: SocketAddr,
    /// Show this axis (X Y Z U V W) under another name and no axis that is not named; for clients that know one axis. Repeat for
    /// more.
    #[arg(long = "axis", value_name = "NAME=AXIS")]
    axes: Vec<String>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let axes = Axes::named(&arguments.axes).map_err(|error| Failure::Usage(format!("--axis: {error}")))?;
    let compiled = arguments.spec.as_deref().map(|spec| spec_file::looked_up(spec, ui)).transpose()?;
    let digest = compiled.as_ref().map(|compiled| compiled.ir.digest.as_str());
    interrupt::heed();
    let (session, name) = arguments.line.open(digest)?;
    let listen = arguments.listen;
    let stage = Stage::new(session).map_err(|error| Failure::Gate(format!("{name}: {error}")))?;
    let no = |error: std::io::Error| Failure::Environment(format!("cannot listen at {listen}: {error}"));
    let listener = TcpListener::bind(listen).map_err(no)?;
    let address = listener.local_addr().map_err(no)?;
    let stop = interrupt::heed();
    let mut bridge = Bridge::new(stage, axes, listener).map_err(no)?;
    if !address.ip().is_loopback() {
        ui.progress("warning: whoever reaches this address can move the machine");
    }
    ui.progress(&format!("{name}: GCS at {address}; Ctrl-C ramps down and ends"));
    let alike = compiled.as_ref().map(|compiled| compiled.ir.supervision.alike().to_vec()).unwrap_or_default();
    let mut shown = String::new();
    let ended = bridge.run(stop, |session| {
        let status = session.status();
        let stands = session.stands(&alike);
        if stands != shown {
            ui.progress(&format!("tick {}: {stands}", status.tick));
            shown = stands;
        }
    });
    let lost = |error: &dyn std::fmt::Display| {
        Failure::Environment(format!(
            "{name}: {error}; a machine that lost its host holds, then ramps down (supervisor.host_lost)"
        ))
    };
    ended.map_err(|error| lost(&error))?;
    let mut operator = Operator::new(bridge.into_session(), stop);
    operator.alike = alike;
    let stands =
        if operator.is_powered() { operator.ramp_down(ui).map_err(|error| lost(&error))? } else { operator.stands() };
    ui.result(&Served { device: name, listened: address.to_string(), stands });
    Ok(())
}
