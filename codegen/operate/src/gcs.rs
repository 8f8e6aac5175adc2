//! A bridge from the General Command Set 2.0 of piezo stages and hexapods, over TCP, to the link.
//!
//! ```text
//! clients ─ TCP ─► Input ─ lines, single bytes ─► commands ─► Stage ─ Session ─ link ─► device
//!                                                              └─ polled at least every 20 ms, whatever clients do
//! ```
//! `docs/gcs.md` lists the supported commands and the differences. One client is in control; every client may query and stop.

mod axes;
mod code;
mod commands;
mod input;
mod server;
mod stage;
#[cfg(test)]
mod tests;

use std::net::{SocketAddr, TcpListener};

use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_link::client::Port;

use crate::commands::{Operator, Service, lost_link};
use crate::session::Session;
pub use axes::Axes;
use server::Bridge;
use stage::Stage;

/// Serves clients at an address until Ctrl-C, then ramps down. `alike` are sets of faults that the wiring check cannot
/// distinguish.
///
/// # Errors
/// The device is not a platform, the address is in use, or the link broke.
pub fn serve<P: Port>(
    session: Session<P>,
    name: &str,
    axes: Axes,
    alike: Vec<Vec<u32>>,
    listen: SocketAddr,
    ui: &Ui,
) -> Result<Service, Failure> {
    let stage = Stage::new(session).map_err(|error| Failure::Gate(format!("{name}: {error}")))?;
    let refused = |error: std::io::Error| Failure::Environment(format!("cannot listen at {listen}: {error}"));
    let listener = TcpListener::bind(listen).map_err(refused)?;
    let address = listener.local_addr().map_err(refused)?;
    let stop = interrupt::heed();
    let mut bridge = Bridge::new(stage, axes, listener).map_err(refused)?;
    if !address.ip().is_loopback() {
        ui.progress("warning: anyone who can reach this address can move the machine");
    }
    ui.progress(&format!("{name}: GCS at {address}; Ctrl-C ramps down and exits"));
    let mut shown = String::new();
    let ending = bridge.run(stop, |session| {
        let state = session.state(&alike);
        if state != shown {
            ui.progress(&format!("tick {}: {state}", session.status().tick));
            shown = state;
        }
    });
    ending.map_err(|error| lost_link(name, &error))?;
    let mut operator = Operator::new(bridge.into_session(), stop);
    operator.alike = alike;
    let state = if operator.is_powered() {
        operator.ramp_down(ui).map_err(|error| lost_link(name, &error))?
    } else {
        operator.state()
    };
    Ok(Service { device: name.to_owned(), listened: address.to_string(), state })
}
