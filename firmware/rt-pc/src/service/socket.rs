//! Lines on a Unix socket: one request a line, one answer a line.

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;

use super::listener::Listener;
use crate::console::Console;
use crate::operator::Said;

/// Connections at once; more are closed at once.
const MOST: usize = 8;
/// Longest line, bytes.
const LONGEST: usize = 4096;
/// Bytes that are taken from a connection in a round.
const ROUND: usize = 1 << 16;

/// The socket with its connections.
pub struct Socket {
    listener: Listener,
    connections: Vec<Connection>,
}

struct Connection {
    stream: UnixStream,
    line: Vec<u8>,
}

impl Socket {
    /// Listens at `path`.
    ///
    /// # Errors
    /// As [`Listener::open`].
    pub fn listen(path: &Path) -> io::Result<Self> {
        Ok(Self { listener: Listener::open(path, "--socket")?, connections: Vec::new() })
    }

    /// Answers what came since the last call. Never waits.
    pub fn serve(&mut self, console: &mut Console, now: u64) {
        while let Some(stream) = self.listener.accept() {
            if self.connections.len() < MOST {
                self.connections.push(Connection { stream, line: Vec::new() });
            }
        }
        self.connections.retain_mut(|connection| connection.serve(console, now).is_ok());
    }

    /// What to wait for.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        std::iter::once(self.listener.descriptor()).chain(self.connections.iter().map(|line| line.stream.as_fd()))
    }
}

impl Connection {
    /// An error ends the connection.
    fn serve(&mut self, console: &mut Console, now: u64) -> io::Result<()> {
        let mut bytes = [0; 512];
        let mut taken = 0;
        while taken < ROUND {
            match self.stream.read(&mut bytes) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    taken += count;
                    self.line.extend_from_slice(&bytes[..count]);
                    self.answer(console, now)?;
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Answers every line that is whole; what is left is the beginning of one.
    fn answer(&mut self, console: &mut Console, now: u64) -> io::Result<()> {
        while let Some(end) = self.line.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.line.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line);
            let answer = match line.trim() {
                "status" => status(console.said.as_ref()),
                line => console.obey(line, now).unwrap_or_else(|error| format!("error: {error}")),
            };
            // A reader that does not read is closed: nobody waits for it.
            self.stream.write_all(format!("{answer}\n").as_bytes())?;
        }
        if self.line.len() > LONGEST {
            let _ = self.stream.write_all(b"error: a line has at most 4096 bytes\n");
            return Err(io::ErrorKind::InvalidData.into());
        }
        Ok(())
    }
}

fn status(last: Option<&Said>) -> String {
    match last {
        None => "no tick yet".to_owned(),
        Some(Said { phase, cause, on, status, tick, .. }) => {
            format!("tick={tick} phase={phase:?} cause={cause:?} amplifiers={} status={status:#x}", u8::from(*on))
        }
    }
}
