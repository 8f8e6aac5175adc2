//! Lines on a Unix socket: one request a line, one answer a line.

use std::io::{self, Write};
use std::os::fd::BorrowedFd;
use std::path::Path;

use super::clients::{Client, Clients, room};
use super::listener::Listener;
use crate::console::Console;
use crate::operator::Said;

/// Longest line, bytes.
const LONGEST: usize = 4096;

/// The socket with its connections: of each, what has come of a line.
pub struct Socket {
    clients: Clients<Vec<u8>>,
}

impl Socket {
    /// Listens at `path`.
    ///
    /// # Errors
    /// As [`Listener::open`].
    pub fn listen(path: &Path) -> io::Result<Self> {
        Ok(Self { clients: Clients::new(Listener::open(path, "--socket")?) })
    }

    /// Answers what came since the last call. Never waits.
    pub fn serve(&mut self, console: &mut Console, now: u64) {
        // Those that make room are closed: nothing is kept of a line.
        self.clients.accept(now, Vec::new, |_| false);
        self.clients.serve(|client| serve(client, console, now));
    }

    /// What to wait for.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.clients.descriptors()
    }
}

/// An error ends the connection.
fn serve(client: &mut Client<Vec<u8>>, console: &mut Console, now: u64) -> io::Result<()> {
    let mut bytes = room();
    let said = client.read(&mut bytes, now)?;
    client.state.extend_from_slice(said);
    let mut answers = String::new();
    while let Some(end) = client.state.iter().position(|byte| *byte == b'\n') {
        let line: Vec<u8> = client.state.drain(..=end).collect();
        let line = String::from_utf8_lossy(&line);
        let answer = match line.trim() {
            "status" => status(console.said.as_ref()),
            line => console.obey(line, now).unwrap_or_else(|error| format!("error: {error}")),
        };
        answers += &answer;
        answers.push('\n');
    }
    // In one piece: many small ones fill the socket long before their bytes do. A reader that does not read is closed: nobody
    // waits for it.
    client.stream.write_all(answers.as_bytes())?;
    // What is left has no end yet.
    if client.state.len() > LONGEST {
        let _ = client.stream.write_all(b"error: a line has at most 4096 bytes\n");
        return Err(io::ErrorKind::InvalidData.into());
    }
    Ok(())
}

fn status(last: Option<&Said>) -> String {
    match last {
        None => "no tick yet".to_owned(),
        Some(Said { phase, cause, on, status, tick, .. }) => {
            format!("tick={tick} phase={phase:?} cause={cause:?} amplifiers={} status={status:#x}", u8::from(*on))
        }
    }
}
