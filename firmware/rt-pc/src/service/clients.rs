//! Clients of a socket: a few at once, and none that keeps others out.
//!
//! A new client always gets in. Where there is no room, the client process with the most connections loses one of them, and of
//! those the one that has been silent for longest; one that has the orders is spared. What a client may send in a round is
//! bounded, so that one that sends without end delays no other.

use std::io::{self, ErrorKind, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

use rustix::net::sockopt::socket_peercred;

use super::listener::Listener;

pub const MOST: usize = 8;
/// Connections that are taken in a round.
const TAKEN: usize = 16;
/// Bytes that are read from a client in a round.
const ROUND: usize = 4096;

pub struct Client<T> {
    /// The connection, which never waits.
    pub stream: UnixStream,
    pub state: T,
    /// Its process, as the system says; 0 if it does not.
    process: i32,
    /// When it last sent something, ns.
    last: u64,
}

pub struct Clients<T> {
    listener: Listener,
    all: Vec<Client<T>>,
}

impl<T> Clients<T> {
    pub fn new(listener: Listener) -> Self {
        Self { listener, all: Vec::with_capacity(MOST) }
    }

    /// Takes who came since the last call, with `fresh` states; gives back those that had to make room. A client that `keeps` its
    /// place is spared.
    pub fn accept(&mut self, now: u64, mut fresh: impl FnMut() -> T, keeps: impl Fn(&T) -> bool) -> Vec<T> {
        let mut gone = Vec::new();
        for _ in 0..TAKEN {
            let Some(stream) = self.listener.accept() else { break };
            let process = socket_peercred(&stream).map_or(0, |credentials| credentials.pid.as_raw_nonzero().get());
            self.all.push(Client { stream, state: fresh(), process, last: now });
            if self.all.len() > MOST
                && let Some(least) = self.least(now, &keeps)
            {
                gone.push(self.all.remove(least).state);
            }
        }
        gone
    }

    /// The one that is missed least.
    fn least(&self, now: u64, keeps: impl Fn(&T) -> bool) -> Option<usize> {
        let connections = |process| self.all.iter().filter(|client| client.process == process).count();
        // The newest is not to make room for itself.
        let others = self.all.iter().enumerate().rev().skip(1).filter(|(_, client)| !keeps(&client.state));
        others
            .max_by_key(|(_, client)| (connections(client.process), now.saturating_sub(client.last)))
            .map(|(index, _)| index)
    }

    /// Lets each be served; gives back those whose service failed.
    pub fn serve(&mut self, mut service: impl FnMut(&mut Client<T>) -> io::Result<()>) -> Vec<T> {
        let gone = self.all.extract_if(.., |client| service(client).is_err());
        gone.map(|client| client.state).collect()
    }

    /// All, in the order in which they came.
    pub fn iter(&self) -> impl Iterator<Item = &Client<T>> {
        self.all.iter()
    }

    /// The same, to change their states.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Client<T>> {
        self.all.iter_mut()
    }

    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        std::iter::once(self.listener.descriptor()).chain(self.all.iter().map(|client| client.stream.as_fd()))
    }
}

impl<T> Client<T> {
    /// What came since the last call, as much of it as one may send in a round. Never waits.
    ///
    /// # Errors
    /// The client has gone.
    pub fn read<'b>(&mut self, bytes: &'b mut [u8; ROUND], now: u64) -> io::Result<&'b [u8]> {
        loop {
            return match self.stream.read(bytes) {
                Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    self.last = now;
                    Ok(&bytes[..count])
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(&[]),
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => Err(error),
            };
        }
    }
}

/// A buffer for what is read from a client in a round.
pub const fn room() -> [u8; ROUND] {
    [0; ROUND]
}
