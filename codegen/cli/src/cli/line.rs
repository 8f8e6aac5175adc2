//! Where the device of a command is.

use clap::Args;
use specgen_link::client::{Port, Timeout};
use specgen_operate::pil::{BAUD, OpenError, SerialLine};
use specgen_operate::{Session, SocketLine};

use super::named::Endpoint;
use specgen_language::outcome::Failure;

/// A serial port or a socket.
#[derive(Args, Debug)]
pub struct Line {
    /// A board at this serial port.
    #[arg(long, value_name = "DEVICE")]
    pub port: Option<Endpoint>,
    /// Its rate, baud.
    #[arg(long, default_value_t = BAUD, requires = "port", conflicts_with = "socket", value_parser = clap::value_parser!(u32).range(1200..=12_000_000))]
    baud: u32,
    /// A program that serves the link at this Unix socket.
    #[arg(long, value_name = "PATH")]
    socket: Option<Endpoint>,
}

impl Line {
    /// Whether a device is named.
    pub fn is_named(&self) -> bool {
        self.port.is_some() || self.socket.is_some()
    }

    /// Opens a session with the device, and its name. With a `digest` only the controller of that spec will do.
    pub fn open(&self, digest: Option<&str>) -> Result<(Session<Box<dyn Port>>, String), Failure> {
        let (line, timeout, path): (Box<dyn Port>, _, _) = match (&self.port, &self.socket) {
            (Some(path), _) => {
                let line = SerialLine::open(path, self.baud).map_err(Failure::Environment)?;
                (Box::new(line), Timeout::SERIAL, path)
            }
            (None, Some(path)) => {
                (Box::new(SocketLine::open(path).map_err(Failure::Environment)?), Timeout::SOCKET, path)
            }
            (None, None) => return Err(Failure::Usage("name the device with --port or --socket".to_owned())),
        };
        let name = path.display().to_string();
        let session = Session::open(line, timeout, digest).map_err(|error| match error {
            OpenError::Other(text) => Failure::Gate(format!("{name}: {text}")),
            OpenError::Link(_) => Failure::Environment(format!("{name}: {error}")),
        })?;
        Ok((session, name))
    }
}
