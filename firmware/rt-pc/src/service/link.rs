//! The link on a Unix socket: the frames of `specgen-link`. Several hosts may connect; one is in control.

use std::io::{self, Write};
use std::os::fd::BorrowedFd;
use std::path::Path;

use rustix::io::ioctl_fionread;
use specgen_link::{Counters, Endpoint};

use super::clients::{Client, Clients, room};
use super::handler::LinkHandler;
use super::listener::Listener;
use crate::console::Console;
use crate::handover::Row;
use crate::operator::HostId;
use crate::samples::Stream;

/// Largest unread output of a connection: more than any answer, because hosts send one request at a time.
const UNREAD: usize = 1 << 14;

/// Statistics of the link in a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Traffic {
    pub hosts: u64,
    /// Requests carried out or refused.
    pub requests: u64,
    /// Invalid frames.
    pub errors: u64,
    /// Connections that were closed: they lost control, or others needed the room.
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
    /// Its requests were sent before a stop of another host, until all of them are read.
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

    /// Passes a tick to the subscribed hosts.
    pub fn show(&mut self, row: &Row) {
        for client in self.hosts.iter_mut() {
            client.state.stream.add(row);
        }
    }

    /// Answers new requests. Never waits.
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
        let crowded = hosts.accept(now, fresh, |line| console.operator.is_owner(line.id));
        traffic.closed += crowded.len() as u64;
        let events = console.take_events();
        let (before, mut stopper) = (console.stops, None);
        let gone = hosts.serve(|client| {
            client.state.events |= events;
            // A host that lost control must reconnect, so that it does not continue unaware.
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
            // A stop is answered once it is known what the others sent before it: later requests count.
            for client in hosts.iter_mut().filter(|client| Some(client.state.id) != stopper) {
                client.find_late();
            }
            for client in hosts.iter_mut().filter(|client| Some(client.state.id) == stopper) {
                // The next call detects a failed line.
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
    /// Whether bytes that were sent by now are still unread.
    fn find_late(&mut self) {
        self.state.is_late = ioctl_fionread(&self.stream).is_ok_and(|unread| unread > 0);
    }
}

/// Carries out the host's requests. An error ends the connection, here and below.
fn obey(client: &mut Client<Line>, console: &mut Console, now: u64) -> io::Result<()> {
    if client.state.unsent.len() < UNREAD {
        let mut bytes = room();
        let said = client.read(&mut bytes, now)?;
        let Line { id, endpoint, unsent, is_late, events, stream } = &mut client.state;
        *is_late &= !said.is_empty();
        let mut handler = LinkHandler::new(console, *id, *is_late, events, stream, now);
        for byte in said {
            if let Some(answer) = endpoint.push(*byte, &mut handler) {
                unsent.extend_from_slice(answer);
            }
        }
    }
    Ok(())
}

/// Sends output to the host, as much as it takes.
fn send(client: &mut Client<Line>) -> io::Result<()> {
    while !client.state.unsent.is_empty() {
        match client.stream.write(&client.state.unsent) {
            Ok(count) => {
                client.state.unsent.drain(..count);
            }
            // A host that does not read is not waited for; its last answer is kept for it.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::{row, said};
    use crate::capture::Capture;
    use crate::operator::{Arbiter, Timeout};
    use controller::supervised::Phase;
    use controller::{CONFIG_WORDS, Config};
    use specgen_link::client::{self, Client as Host, ClientError, Port};
    use specgen_link::{Bytes, Device, Identity, Refusal, Reply, Request, WaveAction, put_words};
    use std::cell::RefCell;
    use std::io::{ErrorKind, Read};
    use std::os::unix::net::UnixStream;
    use std::path::PathBuf;
    use std::rc::Rc;
    use std::time::Duration;

    const SILENCE: u64 = 1000;

    /// The link and what it serves, at a time that the test sets.
    struct World {
        link: Link,
        console: Console,
        now: u64,
        path: PathBuf,
    }

    /// A host's line, which lets the other side work while it waits.
    struct Wire {
        stream: UnixStream,
        world: Rc<RefCell<World>>,
    }

    impl World {
        fn new(name: &str) -> Rc<RefCell<Self>> {
            let path = std::env::temp_dir().join(format!("rt-pc-link-{name}-{}", std::process::id()));
            let operator = Arbiter::new(true, Timeout { silence: SILENCE, idle: 1 << 40 });
            let mut console = Console::new(operator, Capture::new(None).unwrap().0, Config::new());
            console.said = Some(said(Phase::Holding));
            Rc::new(RefCell::new(Self { link: Link::listen(&path).unwrap(), console, now: 10, path }))
        }

        fn serve(&mut self) {
            self.link.serve(&mut self.console, self.now);
        }

        fn commands(&mut self) -> usize {
            self.console.outgoing().0.len()
        }
    }

    impl Port for Wire {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.stream.write_all(bytes)
        }

        fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
            self.world.borrow_mut().serve();
            match self.stream.read(buffer) {
                Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
                Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(0),
                other => other,
            }
        }
    }

    fn line(world: &Rc<RefCell<World>>) -> UnixStream {
        let stream = UnixStream::connect(&world.borrow().path).unwrap();
        stream.set_nonblocking(true).unwrap();
        stream
    }

    const PATIENCE: client::Timeout = client::Timeout { limit: Duration::from_millis(100), attempts: 1 };

    fn host(world: &Rc<RefCell<World>>, session: u16) -> Host<Wire> {
        let wire = Wire { stream: line(world), world: Rc::clone(world) };
        Host::open(wire, session, PATIENCE).map_err(|_| "no session").unwrap().0
    }

    fn refused(error: ClientError) -> Option<Refusal> {
        match error {
            ClientError::Refused(refusal) => Some(refusal),
            _ => None,
        }
    }

    /// Does everything, and keeps the bytes that it was asked by.
    #[derive(Default)]
    struct Tape {
        endpoint: Endpoint,
        asked: Rc<RefCell<Vec<u8>>>,
        answers: Vec<u8>,
    }

    struct Obedient;

    impl Device for Obedient {
        fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
            match request {
                Request::Hello => Reply::Identity(Identity {
                    config_words: 1,
                    input_words: 1,
                    output_words: 1,
                    stages: 0,
                    counted: specgen_link::CostUnit::Nothing,
                    description: 0,
                }),
                _ => Reply::Done,
            }
        }
    }

    impl Port for Tape {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.asked.borrow_mut().extend_from_slice(bytes);
            for byte in bytes {
                if let Some(answer) = self.endpoint.push(*byte, &mut Obedient) {
                    self.answers.extend_from_slice(answer);
                }
            }
            Ok(())
        }

        fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
            let count = buffer.len().min(self.answers.len());
            buffer[..count].copy_from_slice(&self.answers[..count]);
            self.answers.drain(..count);
            Ok(count)
        }
    }

    /// The bytes of a session of so many requests, without waiting for answers.
    fn bytes_of(requests: &[Request<'_>]) -> Vec<u8> {
        let tape = Tape::default();
        let asked = Rc::clone(&tape.asked);
        let (mut host, _) = Host::open(tape, 77, PATIENCE).map_err(|_| "no session").unwrap();
        for request in requests {
            host.ask(request).map_err(|_| "no answer").unwrap();
        }
        asked.take()
    }

    #[test]
    fn traffic_counts_hosts_requests_and_frames_that_are_not_believed() {
        let world = World::new("traffic");
        let (mut first, mut second) = (host(&world, 1), host(&world, 2));
        for host in [&mut first, &mut second] {
            assert!(matches!(host.ask(&Request::Status), Ok(Reply::Status(status)) if status.tick == 8));
        }
        second.port().stream.write_all(&[3, 1, 2, 0, 3, 1, 2, 0]).unwrap();
        world.borrow_mut().serve();
        let read = |world: &Rc<RefCell<World>>| {
            let Traffic { hosts, requests, errors, closed } = world.borrow().link.traffic();
            [hosts, requests, errors, closed]
        };
        assert_eq!(read(&world), [2, 4, 2, 0]);
        assert_eq!(world.borrow().link.descriptors().count(), 3);
        drop(second);
        world.borrow_mut().serve();
        assert_eq!(world.borrow().link.descriptors().count(), 2);
        assert_eq!(read(&world), [2, 4, 2, 0], "those of a host that has gone, too");
        drop(first);
        world.borrow_mut().serve();
        assert_eq!(read(&world), [2, 4, 2, 0]);
    }

    #[test]
    fn a_host_that_hangs_up_before_its_answer_is_gone_in_that_round() {
        let world = World::new("hasty");
        let mut hasty = line(&world);
        hasty.write_all(&bytes_of(&[Request::Status])).unwrap();
        drop(hasty);
        world.borrow_mut().serve();
        assert_eq!((world.borrow().link.descriptors().count(), world.borrow().link.traffic().requests), (1, 2));
    }

    #[test]
    fn events_are_reported_to_each_host_once() {
        let world = World::new("events");
        let (mut first, mut second) = (host(&world, 1), host(&world, 2));
        for event in [1, 8] {
            let mut row = row(0);
            row.input.events = event;
            world.borrow_mut().console.update(&row, said(Phase::Holding), 0);
            world.borrow_mut().serve();
        }
        for host in [&mut first, &mut second] {
            assert!(matches!(host.ask(&Request::Status), Ok(Reply::Status(status)) if status.events == 9));
            assert!(matches!(host.ask(&Request::Health), Ok(Reply::Health(health)) if health.events == 9));
            assert!(matches!(host.ask(&Request::Health), Ok(Reply::Health(health)) if health.events == 0));
        }
    }

    #[test]
    fn a_ninth_host_gets_in_and_the_one_with_the_orders_stays() {
        let world = World::new("crowd");
        let mut owner = host(&world, 1);
        assert_eq!(owner.ask(&Request::Supervise { request: 0 }).map_err(refused), Ok(Reply::Done));
        let mut others = Vec::new();
        for session in 2..=9 {
            world.borrow_mut().now += 1;
            others.push(host(&world, session));
        }
        assert_eq!(world.borrow().link.traffic().closed, 1);
        assert!(owner.ask(&Request::Status).is_ok() && others[7].ask(&Request::Status).is_ok());
        assert!(matches!(others[0].ask(&Request::Status), Err(ClientError::Port(_))));
    }

    #[test]
    fn a_host_that_lost_the_orders_is_closed_and_comes_anew() {
        let world = World::new("evicted");
        let (mut first, mut second) = (host(&world, 1), host(&world, 2));
        let arm = Request::Supervise { request: 1 };
        assert_eq!(first.ask(&arm).map_err(refused), Ok(Reply::Done));
        assert_eq!(second.ask(&arm).map_err(refused), Err(Some(Refusal::Busy)));
        world.borrow_mut().now += SILENCE + 1;
        assert_eq!(second.ask(&arm).map_err(refused), Ok(Reply::Done));
        assert!(matches!(first.ask(&Request::Status), Err(ClientError::Port(_))));
        assert_eq!(world.borrow().link.traffic().closed, 1);
        // A host that hangs up while the machine is powered is missed by nobody else.
        drop(second);
        world.borrow_mut().serve();
        assert!(!world.borrow().console.operator.host_in_control(world.borrow().now));
        assert_eq!(host(&world, 3).ask(&arm).map_err(refused), Ok(Reply::Done));
    }

    #[test]
    fn a_host_that_does_not_read_is_not_waited_for_and_loses_nothing() {
        let world = World::new("unread");
        let mut deaf = line(&world);
        let describe = [Request::Describe { offset: 0 }; 1000];
        let asked = bytes_of(&describe);
        let mut rest = &asked[..];
        let mut other = host(&world, 5);
        for _ in 0..50 {
            if let Ok(count) = deaf.write(rest) {
                rest = &rest[count..];
            }
            assert!(other.ask(&Request::Status).is_ok());
            let waiting = world.borrow().link.hosts.iter().map(|client| client.state.unsent.len()).max().unwrap();
            // What it sends in a round is answered once there is room again: a thousand bytes for every request of some ten.
            assert!(waiting < UNREAD + 4096 * 100, "{waiting}");
        }
        assert!(world.borrow().link.traffic().requests < 1000);
        // Once it reads it gets everything: the identity, and as many pieces as it asked for.
        let (mut frames, mut bytes) = (0, vec![0; 1 << 16]);
        for _ in 0..10_000 {
            if let Ok(count) = deaf.write(rest) {
                rest = &rest[count..];
            }
            world.borrow_mut().serve();
            if let Ok(count) = deaf.read(&mut bytes) {
                frames += bytes[..count].iter().filter(|byte| **byte == 0).count();
            }
            if frames == 1001 {
                break;
            }
        }
        assert_eq!((frames, rest.len()), (1001, 0));
    }

    /// Settings again and again: each that is obeyed is one order to the loop.
    fn settings(count: usize) -> Vec<u8> {
        let mut words = [0; size_of::<[u64; CONFIG_WORDS]>()];
        let words = put_words(&Config::new().to_words(), &mut words).unwrap();
        bytes_of(&vec![Request::WriteConfig { words }; count])
    }

    #[test]
    fn what_was_sent_before_a_stop_of_another_host_is_refused() {
        const SENT: usize = 30;
        // The stop comes from a host that is served before the sender, and from one that is served behind it.
        for stops_first in [true, false] {
            let world = World::new(&format!("late-{stops_first}"));
            let mut stopper = stops_first.then(|| host(&world, 1));
            let mut sender = line(&world);
            world.borrow_mut().serve();
            let mut stopper = stopper.take().unwrap_or_else(|| host(&world, 1));
            let sent = settings(SENT);
            sender.write_all(&sent).unwrap();
            // Hold.
            assert_eq!(stopper.ask(&Request::Supervise { request: 3 }).map_err(refused), Ok(Reply::Done));
            let obeyed = world.borrow_mut().commands();
            assert!(if stops_first { obeyed == 0 } else { (1..SENT / 2).contains(&obeyed) }, "{obeyed}");
            for _ in 0..20 {
                world.borrow_mut().serve();
            }
            assert_eq!(world.borrow_mut().commands(), obeyed);
            assert_eq!(world.borrow().link.traffic().requests, 2 + 1 + SENT as u64);
            // What comes after that counts.
            drop(sender);
            let mut sender = host(&world, 9);
            let stop = Request::Wave { action: WaveAction::Stop, words: Bytes(&[]) };
            world.borrow_mut().now += SILENCE + 1;
            assert_eq!(sender.ask(&stop).map_err(refused), Ok(Reply::Done));
            assert_eq!(world.borrow_mut().commands(), obeyed + 1);
        }
    }

    #[test]
    fn a_host_that_looks_on_gets_a_row_of_every_tick_from_then_on() {
        let world = World::new("stream");
        let mut host = host(&world, 1);
        world.borrow_mut().link.show(&row(1));
        assert_eq!(host.ask(&Request::Stream { every: 1 }).map_err(refused), Ok(Reply::Done));
        for tick in 2..5 {
            world.borrow_mut().link.show(&row(tick));
        }
        let Ok(Reply::Samples { tick, every, rows, .. }) = host.ask(&Request::Samples) else { panic!("no samples") };
        assert_eq!((tick, every), (2, 1));
        assert_eq!(specgen_link::samples::rows(1, rows.0).unwrap().len(), 3);
    }
}
