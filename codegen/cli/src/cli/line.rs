//! Connection options of commands that need a device.

use std::path::Path;

use clap::Args;
use specgen_language::outcome::Failure;
use specgen_link::client::Port;
use specgen_operate::Session;
use specgen_operate::pil::BAUD;

use super::path_roles::Endpoint;

/// A serial port or a socket.
#[derive(Args, Debug)]
pub struct Line {
    /// Serial port of a board.
    #[arg(long, value_name = "DEVICE")]
    pub port: Option<Endpoint>,
    /// Baud rate of the serial port.
    #[arg(long, default_value_t = BAUD, requires = "port", conflicts_with = "socket", value_parser = clap::value_parser!(u32).range(1200..=12_000_000))]
    baud: u32,
    /// Unix socket of a controller program on this computer (`rt-pc --link PATH`).
    #[arg(long, value_name = "PATH")]
    socket: Option<Endpoint>,
}

impl Line {
    /// Whether a device is named.
    pub fn is_named(&self) -> bool {
        self.port.is_some() || self.socket.is_some()
    }

    /// The Unix socket, if it is one.
    pub fn socket(&self) -> Option<&Path> {
        self.socket.as_deref()
    }

    /// The line to the device.
    pub fn end(&self) -> Result<specgen_operate::Line<'_>, Failure> {
        match (&self.port, &self.socket) {
            (Some(path), _) => Ok(specgen_operate::Line::Serial(path, self.baud)),
            (None, Some(path)) => Ok(specgen_operate::Line::Socket(path)),
            (None, None) => Err(Failure::Usage("name the device with --port or --socket".to_owned())),
        }
    }

    /// Opens a session with the device, and returns its name. With a `digest` only the controller of that spec is accepted.
    pub fn open(&self, digest: Option<&str>) -> Result<(Session<Box<dyn Port>>, String), Failure> {
        self.end()?.open(digest)
    }
}
