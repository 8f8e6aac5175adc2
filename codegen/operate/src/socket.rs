//! A device at a Unix stream socket, with the same frames as on a serial line.

use std::io::{self, ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use specgen_link::client::Port;

use crate::pil::wait::receive;

/// Timeout of sending.
const SEND: Duration = Duration::from_secs(2);

/// A connection.
pub struct SocketLine {
    stream: UnixStream,
}

impl SocketLine {
    /// Connects.
    ///
    /// # Errors
    /// No program listens there, or no permission.
    pub fn open(path: &Path) -> Result<Self, String> {
        let advice = |error: io::Error| {
            let name = path.display();
            match error.kind() {
                ErrorKind::NotFound => format!("there is no socket `{name}`; is the program that serves it running?"),
                ErrorKind::ConnectionRefused => format!("no program listens at `{name}`; start the one that serves it"),
                _ => format!("cannot connect to `{name}`: {error}"),
            }
        };
        let stream = UnixStream::connect(path).map_err(advice)?;
        stream.set_write_timeout(Some(SEND)).map_err(advice)?;
        Ok(Self { stream })
    }
}

impl Port for SocketLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        receive(&mut self.stream, buffer, limit, "the program at the socket closed the connection")
    }
}
