//! The link to a device: a serial port or a socket.

use std::path::Path;

use specgen_language::outcome::Failure;
use specgen_link::client::{Port, Timeout};

use crate::pil::{OpenError, SerialLine};
use crate::session::Session;
use crate::socket::SocketLine;

/// A serial port or a socket.
#[derive(Debug, Clone, Copy)]
pub enum Line<'a> {
    /// A board at this serial port, at this rate in baud.
    Serial(&'a Path, u32),
    /// A program that serves the link at this Unix socket.
    Socket(&'a Path),
}

impl Line<'_> {
    /// Opens a session with the device, and returns its name. With a `digest` only the controller of that spec is accepted.
    ///
    /// # Errors
    /// The line does not open, or another controller answers.
    pub fn open(self, digest: Option<&str>) -> Result<(Session<Box<dyn Port>>, String), Failure> {
        let (port, timeout, path): (Box<dyn Port>, _, _) = match self {
            Self::Serial(path, baud) => {
                (Box::new(SerialLine::open(path, baud).map_err(Failure::Environment)?), Timeout::SERIAL, path)
            }
            Self::Socket(path) => {
                (Box::new(SocketLine::open(path).map_err(Failure::Environment)?), Timeout::SOCKET, path)
            }
        };
        let name = path.display().to_string();
        let session = Session::open(port, timeout, digest).map_err(|error| match error {
            OpenError::Other(text) => Failure::Gate(format!("{name}: {text}")),
            OpenError::Link(_) => Failure::Environment(format!("{name}: {error}")),
        })?;
        Ok((session, name))
    }
}
