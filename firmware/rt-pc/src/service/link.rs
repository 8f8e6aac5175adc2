//! The link on a Unix socket: the frames of `specgen-link`, one host at a time.

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;

use specgen_link::{Counters, Device, Endpoint, Refusal};

use super::desk::{Closed, Desk};
use super::listener::Listener;
use crate::console::Console;

/// Hosts that are told at once that another one is there; more are closed.
const GUESTS: usize = 4;
/// Bytes that are taken from a connection in a round.
const ROUND: usize = 1 << 16;
/// Bytes that a connection may leave unread: more than any answer, and hosts ask one thing at a time.
const UNREAD: usize = 1 << 14;

/// What came over the link in a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Traffic {
    /// Hosts that connected, those that were refused included.
    pub hosts: u64,
    /// Requests carried out or refused.
    pub requests: u64,
    /// Frames that were not believed.
    pub errors: u64,
    /// Hosts that found another one there.
    pub refused: u64,
}

impl Traffic {
    fn add(&mut self, counters: &Counters) {
        self.requests += u64::from(counters.executed);
        self.errors += u64::from(counters.errors());
    }
}

/// The socket with its connections.
pub struct Link {
    listener: Listener,
    host: Option<Line>,
    guests: Vec<Line>,
    traffic: Traffic,
}

struct Line {
    stream: UnixStream,
    endpoint: Box<Endpoint>,
    unsent: Vec<u8>,
}

impl Link {
    /// Listens at `path`.
    ///
    /// # Errors
    /// As [`Listener::open`].
    pub fn listen(path: &Path) -> io::Result<Self> {
        let listener = Listener::open(path, "--link")?;
        Ok(Self { listener, host: None, guests: Vec::new(), traffic: Traffic::default() })
    }

    /// Answers what came since the last call. Never waits.
    pub fn serve(&mut self, console: &mut Console, now: u64) {
        // First, so that one who has gone makes room for the next.
        self.serve_host(console, now);
        while let Some(stream) = self.listener.accept() {
            self.traffic.hosts += 1;
            let line = Line { stream, endpoint: Box::default(), unsent: Vec::new() };
            if self.host.is_none() {
                self.host = Some(line);
                self.serve_host(console, now);
            } else {
                self.traffic.refused += 1;
                if self.guests.len() < GUESTS {
                    self.guests.push(line);
                }
            }
        }
        let traffic = &mut self.traffic;
        self.guests.retain_mut(|guest| {
            let stays = guest.serve(&mut Closed(Refusal::Busy)).is_ok();
            if !stays {
                traffic.add(guest.endpoint.counters());
            }
            stays
        });
    }

    fn serve_host(&mut self, console: &mut Console, now: u64) {
        // One from whom lines took the orders is to come anew.
        let evicted = console.operator.take_evicted();
        let Some(mut host) = self.host.take() else { return };
        if !evicted && host.serve(&mut Desk::new(console, now)).is_ok() {
            self.host = Some(host);
        } else {
            self.traffic.add(host.endpoint.counters());
            console.operator.left(console.said.as_ref());
        }
    }

    /// What to wait for.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        let lines = self.host.iter().chain(&self.guests).map(|line| line.stream.as_fd());
        std::iter::once(self.listener.descriptor()).chain(lines)
    }

    /// What came in all.
    pub fn traffic(&self) -> Traffic {
        let mut traffic = self.traffic;
        for line in self.host.iter().chain(&self.guests) {
            traffic.add(line.endpoint.counters());
        }
        traffic
    }
}

impl Line {
    /// An error ends the connection.
    fn serve(&mut self, device: &mut impl Device) -> io::Result<()> {
        let mut bytes = [0; 4096];
        let mut taken = 0;
        while taken < ROUND && self.unsent.len() < UNREAD {
            match self.stream.read(&mut bytes) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    taken += count;
                    for byte in &bytes[..count] {
                        if let Some(answer) = self.endpoint.push(*byte, device) {
                            self.unsent.extend_from_slice(answer);
                        }
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        while !self.unsent.is_empty() {
            match self.stream.write(&self.unsent) {
                Ok(count) => {
                    self.unsent.drain(..count);
                }
                // Nobody waits for a host that does not read; what it asked for last is still there for it.
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}
