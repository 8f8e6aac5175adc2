//! The link on a Unix socket: the frames of `specgen-link`. Several hosts may look; one has the orders.

use std::io::{self, Write};
use std::os::fd::BorrowedFd;
use std::path::Path;

use rustix::io::ioctl_fionread;
use specgen_link::{Counters, Endpoint};

use super::clients::{Client, Clients, room};
use super::desk::Desk;
use super::listener::Listener;
use crate::console::Console;
use crate::handover::Row;
use crate::operator::HostId;
use crate::samples::Stream;

/// Bytes that a connection may leave unread: more than any answer, and hosts ask one thing at a time.
const UNREAD: usize = 1 << 14;

/// What came over the link in a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Traffic {
    pub hosts: u64,
    /// Requests carried out or refused.
    pub requests: u64,
    /// Frames that were not believed.
    pub errors: u64,
    /// Hosts that were closed: they lost the orders, or others needed the room.
    pub closed: u64,
}

impl Traffic {
    fn add(&mut self, counters: &Counters) {
        self.requests += u64::from(counters.executed);
        self.errors += u64::from(counters.errors());
    }
}

pub struct Link {
    hosts: Clients<Line>,
    traffic: Traffic,
}

struct Line {
    id: HostId,
    endpoint: Box<Endpoint>,
    unsent: Vec<u8>,
    /// What it sends was sent before a stop of another host, until nothing of it is left.
    is_late: bool,
    /// Events that were not yet reported to this host.
    events: u32,
    stream: Stream,
}

impl Link {
    /// Listens at `path`.
    ///
    /// # Errors
    /// As [`Listener::open`].
    pub fn listen(path: &Path) -> io::Result<Self> {
        let hosts = Clients::new(Listener::open(path)?);
        Ok(Self { hosts, traffic: Traffic::default() })
    }

    /// Shows a tick to the hosts that look on.
    pub fn show(&mut self, row: &Row) {
        for client in self.hosts.iter_mut() {
            client.state.stream.add(row);
        }
    }

    /// Answers what came since the last call. Never waits.
    pub fn serve(&mut self, console: &mut Console, now: u64) {
        let Self { hosts, traffic } = self;
        let fresh = || {
            traffic.hosts += 1;
            Line {
                id: HostId(traffic.hosts),
                endpoint: Box::default(),
                unsent: Vec::new(),
                is_late: false,
                events: 0,
                stream: Stream::default(),
            }
        };
        let crowded = hosts.accept(now, fresh, |line| console.operator.is_hosts(line.id));
        traffic.closed += crowded.len() as u64;
        let events = console.take_events();
        let (before, mut stopper) = (console.stops, None);
        let gone = hosts.serve(|client| {
            client.state.events |= events;
            // One that another took the orders from is to come anew, so that it does not go on as if nothing had happened.
            if console.operator.is_evicted(client.state.id) {
                traffic.closed += 1;
                return Err(io::ErrorKind::ConnectionAborted.into());
            }
            if console.stops != before {
                client.find_late();
            }
            let stops = console.stops;
            obey(client, console, now)?;
            if console.stops != stops {
                stopper = Some(client.state.id);
                return Ok(());
            }
            send(client)
        });
        if console.stops != before {
            // A stop is answered when it is known what the others sent before it: what comes after the answer counts.
            for client in hosts.iter_mut().filter(|client| Some(client.state.id) != stopper) {
                client.find_late();
            }
            for client in hosts.iter_mut().filter(|client| Some(client.state.id) == stopper) {
                // The next call finds out what became of a line that fails.
                let _ = send(client);
            }
        }
        for line in crowded.iter().chain(&gone) {
            traffic.add(line.endpoint.counters());
            console.operator.left(line.id, console.said.as_ref());
        }
    }

    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.hosts.descriptors()
    }

    pub fn traffic(&self) -> Traffic {
        let mut traffic = self.traffic;
        for client in self.hosts.iter() {
            traffic.add(client.state.endpoint.counters());
        }
        traffic
    }
}

impl Client<Line> {
    /// Whether something that was sent by now is still to be read.
    fn find_late(&mut self) {
        self.state.is_late = ioctl_fionread(&self.stream).is_ok_and(|unread| unread > 0);
    }
}

/// Does what the host asks for. An error ends the connection, here and below.
fn obey(client: &mut Client<Line>, console: &mut Console, now: u64) -> io::Result<()> {
    if client.state.unsent.len() < UNREAD {
        let mut bytes = room();
        let said = client.read(&mut bytes, now)?;
        let Line { id, endpoint, unsent, is_late, events, stream } = &mut client.state;
        *is_late &= !said.is_empty();
        let mut desk = Desk::new(console, *id, *is_late, events, stream, now);
        for byte in said {
            if let Some(answer) = endpoint.push(*byte, &mut desk) {
                unsent.extend_from_slice(answer);
            }
        }
    }
    Ok(())
}

/// Sends what there is for the host, as far as it takes it.
fn send(client: &mut Client<Line>) -> io::Result<()> {
    while !client.state.unsent.is_empty() {
        match client.stream.write(&client.state.unsent) {
            Ok(count) => {
                client.state.unsent.drain(..count);
            }
            // A host that does not read is not waited for; what it asked for last is still there for it.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
