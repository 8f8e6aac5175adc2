//! Clients of a socket: several at once, and none that locks others out.
//!
//! A new client is always accepted. Without room, the process with the most connections loses the one that has been
//! silent for longest; the client in control is spared. The bytes per client and round are bounded, so that a client
//! that sends continuously delays no other.

use std::io::{self, ErrorKind, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

use rustix::net::sockopt::socket_peercred;

use super::listener::Listener;

pub const MOST: usize = 8;
/// Connections accepted per round.
const TAKEN: usize = 16;
/// Bytes read from a client per round.
const ROUND: usize = 4096;

pub struct Client<T> {
    /// The connection, which never waits.
    pub stream: UnixStream,
    pub state: T,
    /// Its process, by the operating system; 0 if it is not known.
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

    /// Accepts new clients with `fresh` states; returns those that had to make room. A client that `keeps` its place is
    /// spared.
    pub fn accept(&mut self, now: u64, mut fresh: impl FnMut() -> T, keeps: impl Fn(&T) -> bool) -> Vec<T> {
        let mut gone = Vec::new();
        for _ in 0..TAKEN {
            let Some(stream) = self.listener.accept() else { break };
            let process = socket_peercred(&stream).map_or(0, |credentials| credentials.pid.as_raw_nonzero().get());
            self.all.push(Client { stream, state: fresh(), process, last: now });
            if self.all.len() > MOST {
                if let Some(least) = self.least(now, &keeps) {
                    gone.push(self.all.remove(least).state);
                }
            }
        }
        gone
    }

    /// The client to drop.
    fn least(&self, now: u64, keeps: impl Fn(&T) -> bool) -> Option<usize> {
        let connections = |process| self.all.iter().filter(|client| client.process == process).count();
        // Never the newest itself.
        let others = self.all.iter().enumerate().rev().skip(1).filter(|(_, client)| !keeps(&client.state));
        others
            .max_by_key(|(_, client)| (connections(client.process), now.saturating_sub(client.last)))
            .map(|(index, _)| index)
    }

    /// Serves each client; returns those whose service failed.
    pub fn serve(&mut self, mut service: impl FnMut(&mut Client<T>) -> io::Result<()>) -> Vec<T> {
        let (mut gone, mut index) = (Vec::new(), 0);
        while let Some(client) = self.all.get_mut(index) {
            if service(client).is_err() {
                gone.push(self.all.remove(index).state);
            } else {
                index += 1;
            }
        }
        gone
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
    /// Reads new bytes, up to the limit of a round. Never waits.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::path::PathBuf;

    /// A listener, and clients that come at times 0, 1, 2 …, each with its number as state.
    struct TestClients {
        clients: Clients<usize>,
        path: PathBuf,
        lines: Vec<UnixStream>,
    }

    impl TestClients {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("rt-pc-clients-{name}-{}", std::process::id()));
            Self { clients: Clients::new(Listener::open(&path).unwrap()), path, lines: Vec::new() }
        }

        /// One more client; those that had to go.
        fn come(&mut self, keeps: impl Fn(&usize) -> bool) -> Vec<usize> {
            let number = self.lines.len();
            self.lines.push(UnixStream::connect(&self.path).unwrap());
            self.clients.accept(number as u64, || number, keeps)
        }

        fn numbers(&self) -> Vec<usize> {
            self.clients.iter().map(|client| client.state).collect()
        }

        fn read(&mut self, now: u64) -> (Vec<Vec<u8>>, Vec<usize>) {
            let mut all = Vec::new();
            let gone = self.clients.serve(|client| {
                all.push(client.read(&mut room(), now)?.to_vec());
                Ok(())
            });
            (all, gone)
        }
    }

    #[test]
    fn the_client_that_was_silent_for_longest_makes_room_unless_it_keeps_its_place() {
        let mut hall = TestClients::new("silent");
        for number in 0..MOST {
            assert_eq!(hall.come(|_| false), [] as [usize; 0]);
            assert_eq!(hall.clients.descriptors().count(), number + 2);
        }
        assert!(hall.clients.iter().all(|client| client.process == std::process::id() as i32));
        // The first two send something, and the third is in control.
        for number in [0, 1] {
            hall.lines[number].write_all(b"here").unwrap();
        }
        let (said, gone) = hall.read(100);
        assert_eq!(said.iter().filter(|said| *said == b"here").count(), 2);
        assert!(said[2..].iter().all(Vec::is_empty) && gone.is_empty());
        assert_eq!(hall.come(|number| *number == 2), [3]);
        assert_eq!(hall.numbers(), [0, 1, 2, 4, 5, 6, 7, 8]);
        assert_eq!(hall.clients.iter_mut().count(), MOST);
        // The process with the most connections loses one first, however silent the others are.
        for client in hall.clients.iter_mut().filter(|client| client.state <= 5) {
            client.process = client.state as i32 + 1_000_000;
        }
        assert_eq!(hall.come(|_| false), [6]);
        // Where all the others keep theirs, nobody goes: not the new one either.
        assert_eq!(hall.come(|_| true), [] as [usize; 0]);
        assert_eq!(hall.numbers().len(), MOST + 1);
    }

    #[test]
    fn a_client_that_hangs_up_is_given_back_and_one_that_floods_is_read_in_pieces() {
        let mut hall = TestClients::new("gone");
        for _ in 0..3 {
            hall.come(|_| false);
        }
        hall.lines[1] = UnixStream::connect(&hall.path).unwrap();
        hall.lines[2].write_all(&vec![7; 3 * ROUND / 2]).unwrap();
        let (said, gone) = hall.read(9);
        assert_eq!(said.iter().map(Vec::len).collect::<Vec<_>>(), [0, ROUND]);
        assert_eq!((gone, hall.numbers()), (vec![1], vec![0, 2]));
        // One that leaves without having read what it was sent ends with an error of its own.
        hall.clients.iter_mut().next().unwrap().stream.write_all(b"answer").unwrap();
        hall.lines.remove(0);
        let (said, gone) = hall.read(10);
        assert_eq!((said.len(), gone, hall.numbers()), (1, vec![0], vec![2]));
        assert!(said[0].len() == ROUND / 2 && said[0].iter().all(|byte| *byte == 7));
        assert_eq!(room(), [0; ROUND]);
    }

    #[test]
    fn no_more_come_in_a_round_than_can_be_served() {
        let mut hall = TestClients::new("many");
        let path = hall.path.clone();
        hall.lines.extend((0..TAKEN + 4).map(|_| UnixStream::connect(&path).unwrap()));
        assert_eq!(hall.clients.accept(0, || 0, |_| false).len(), TAKEN - MOST);
        assert_eq!(hall.clients.accept(0, || 0, |_| false).len(), 4);
        assert_eq!(hall.numbers().len(), MOST);
    }
}
