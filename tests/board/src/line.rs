//! The other end of the link: a Unix stream socket, one host at a time.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// Most bytes that wait for the board: a host that sends more is held up.
const WAITING: usize = 4096;

pub struct Line {
    listener: UnixListener,
    host: Option<UnixStream>,
}

impl Line {
    /// Listens at `path`; a socket that was left there goes.
    pub fn listen(path: &Path) -> std::io::Result<Self> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let listener = UnixListener::bind(path)?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener, host: None })
    }

    /// Moves what there is both ways.
    pub fn exchange(&mut self, incoming: &mut VecDeque<u8>, outgoing: &mut Vec<u8>) {
        if let Ok((stream, _)) = self.listener.accept() {
            // The latest one counts, as after a cable was plugged in again.
            self.host = stream.set_nonblocking(true).ok().map(|()| stream);
        }
        let Some(host) = &mut self.host else {
            outgoing.clear();
            return;
        };
        let mut gone = false;
        let mut bytes = [0; WAITING];
        let room = WAITING.saturating_sub(incoming.len());
        if room > 0 {
            match host.read(&mut bytes[..room]) {
                Ok(0) => gone = true,
                Ok(count) => incoming.extend(&bytes[..count]),
                Err(error) => gone = error.kind() != ErrorKind::WouldBlock,
            }
        }
        if !outgoing.is_empty() {
            match host.write(outgoing) {
                Ok(count) => drop(outgoing.drain(..count)),
                Err(error) => gone |= error.kind() != ErrorKind::WouldBlock,
            }
        }
        if gone {
            self.host = None;
        }
    }
}
