//! The other end of the link: a Unix stream socket, one host at a time.
//!
//! A host counts the computer's time and a board its own. While a host is there and silent for longer than it ever is, it is the computer
//! that has no time for it: then the board's time stands still, so that a loaded computer is no host that is lost. One that ended has
//! closed its socket.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

use crate::time::{MICROSECOND, Time};

/// Most bytes that wait for the board: a host that sends more is held up.
const WAITING: usize = 4096;
/// A host asks every 20 ms (`specgen_operate::POLL_INTERVAL`): half of what a board may take for a loss (100 ms).
const SILENCE: Time = 50_000 * MICROSECOND;

pub struct Line {
    listener: UnixListener,
    host: Option<UnixStream>,
    /// When the host sent something last; not before its first byte.
    heard: Option<Time>,
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
        Ok(Self { listener, host: None, heard: None })
    }

    /// Whether time has to stand still until the host has got its share of the computer.
    pub fn holds(&self, now: Time) -> bool {
        self.heard.is_some_and(|heard| now > heard + SILENCE)
    }

    /// Moves what there is both ways.
    pub fn exchange(&mut self, now: Time, incoming: &mut VecDeque<u8>, outgoing: &mut Vec<u8>) {
        if let Ok((stream, _)) = self.listener.accept() {
            // The latest one counts, as after a cable was plugged in again.
            self.host = stream.set_nonblocking(true).ok().map(|()| stream);
            self.heard = None;
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
                Ok(count) => {
                    incoming.extend(&bytes[..count]);
                    self.heard = Some(now);
                }
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
            (self.host, self.heard) = (None, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stands_still_for_a_host_that_is_there_and_for_no_other() {
        let path = std::env::temp_dir().join(format!("emulated-line-{}.sock", std::process::id()));
        let mut line = Line::listen(&path).unwrap();
        let (mut incoming, mut outgoing) = (VecDeque::new(), Vec::new());
        let late = 2 * SILENCE;
        assert!(!line.holds(late), "nobody is there");
        let mut host = UnixStream::connect(&path).unwrap();
        line.exchange(0, &mut incoming, &mut outgoing);
        assert!(!line.holds(late), "it has not begun");
        host.write_all(&[1]).unwrap();
        line.exchange(0, &mut incoming, &mut outgoing);
        assert_eq!((incoming.len(), line.holds(SILENCE), line.holds(late)), (1, false, true));
        host.write_all(&[2]).unwrap();
        line.exchange(late, &mut incoming, &mut outgoing);
        assert!(!line.holds(late));
        drop(host);
        line.exchange(late, &mut incoming, &mut outgoing);
        assert!(!line.holds(4 * late), "it has gone");
        std::fs::remove_file(path).unwrap();
    }
}
