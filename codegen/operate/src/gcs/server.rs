//! Clients over TCP: many may ask, one has the orders, any may stop the machine, and none keeps it waiting.
//!
//! Before an order is carried out everything that has come in is read, of every client: a stop among it overtakes all of it.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::sockopt;
use specgen_link::client::{ClientError, Port};

use super::axes::Axes;
use super::code::Code;
use super::commands::{Asked, execute};
use super::input::{Input, Piece};
use super::stage::{No, Stage};
use crate::session::Session;

/// Clients at a time that may do everything.
const MOST: usize = 16;
/// Clients beyond that may only stop the machine, until one of the others leaves or has to make room.
const RESERVED: usize = 4;
/// Connections that are taken in a round.
const TAKEN: usize = 16;
/// Bytes that are read from a client at once, and in a round.
const PART: usize = 1 << 14;
const ROUND: usize = 1 << 20;
/// Bytes that are read from a client to find the end of what it sent before a stop.
const DRAINED: usize = 1 << 26;
/// Commands of a client that are carried out in a round.
const TURN: usize = 32;
/// Bytes that a client may leave unread before its commands wait.
const UNREAD: usize = 1 << 16;
/// How long a command may wait for a machine that comes up or to rest.
const PATIENCE: Duration = Duration::from_secs(12);
/// A client that has ordered nothing for so long loses the orders to the next that orders.
const IDLE: Duration = Duration::from_secs(60);
/// A client that has been silent for so long makes room for one for whom there is none.
const SILENT: Duration = Duration::from_secs(5);
/// A connection without a sign of life for so long is looked after, and closed if it stays so for as long again.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// What comes from a client after a stop of another was sent before it, until the client pauses for so long or has been told, and for so
/// long at most.
const PAUSE: Duration = Duration::from_millis(50);
const LATE: Duration = Duration::from_secs(1);
/// How long one that has closed its side may take to read.
const GOODBYE: Duration = Duration::from_secs(2);
/// Between two looks while something is under way.
const SOON: Duration = Duration::from_millis(1);

struct Client {
    number: u64,
    stream: TcpStream,
    input: Input,
    unsent: Vec<u8>,
    error: Option<Code>,
    /// When it last sent something.
    heard: Instant,
    /// Since when another has stopped the machine, while what it sends may have been sent before.
    late: Option<Instant>,
    /// Since when the command whose turn it is waits for the machine.
    waits: Option<Instant>,
    /// Since when it sends nothing any more.
    left: Option<Instant>,
}

/// Who gave the last order, and when.
struct Owner {
    number: u64,
    ordered: Instant,
}

/// A machine that GCS clients move.
pub struct Bridge<P> {
    stage: Stage<P>,
    axes: Axes,
    listener: TcpListener,
    clients: Vec<Client>,
    owner: Option<Owner>,
    /// Clients so far.
    count: u64,
}

impl<P: Port> Bridge<P> {
    /// Of a machine, for clients of a listener.
    ///
    /// # Errors
    /// What the system says.
    pub fn new(stage: Stage<P>, axes: Axes, listener: TcpListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { stage, axes, listener, clients: Vec::new(), owner: None, count: 0 })
    }

    /// Serves until `stop`. The machine is looked at in between, and told to `look` at.
    ///
    /// # Errors
    /// The link to the machine broke.
    pub fn run(&mut self, stop: &AtomicBool, mut look: impl FnMut(&Session<P>)) -> Result<(), ClientError> {
        while !stop.load(Ordering::Relaxed) {
            self.wait();
            self.accept()?;
            if self.is_pressed() || self.stage.due().is_zero() {
                self.stage.look()?;
                look(self.stage.session());
            }
            self.hear()?;
            self.part();
            for index in 0..self.clients.len() {
                self.serve(index)?;
            }
        }
        Ok(())
    }

    /// The machine as it is left.
    pub fn into_session(self) -> Session<P> {
        self.stage.into_session()
    }

    /// Something is under way that wants the machine looked at often.
    fn is_pressed(&self) -> bool {
        self.stage.moves() || self.clients.iter().any(|client| client.waits.is_some())
    }

    /// Until a client sends something or takes what it is sent, or the machine has to be looked at.
    fn wait(&self) {
        let due = self.stage.due();
        let is_pressed = self.is_pressed();
        let has_work = self.clients.iter().any(|client| client.waits.is_none() && client.is_ready());
        let limit = if has_work {
            Duration::ZERO
        } else if is_pressed && due > SOON {
            SOON
        } else {
            due
        };
        let mut files = vec![PollFd::new(&self.listener, PollFlags::IN)];
        for client in &self.clients {
            let mut flags = PollFlags::empty();
            if client.left.is_none() {
                flags |= PollFlags::IN;
            }
            if !client.unsent.is_empty() {
                flags |= PollFlags::OUT;
            }
            files.push(PollFd::from_borrowed_fd(client.stream.as_fd(), flags));
        }
        // A signal ends it early, and whatever else it says there is a next round.
        match Timespec::try_from(limit).map(|limit| poll(&mut files, Some(&limit))) {
            Ok(Ok(_) | Err(Errno::INTR)) => {}
            _ => std::thread::sleep(SOON),
        }
    }

    /// Takes who came. A client always gets in: in the place of one that has long been silent, or where it may only stop the machine.
    fn accept(&mut self) -> Result<(), ClientError> {
        for _ in 0..TAKEN {
            let Ok((stream, _)) = self.listener.accept() else { break };
            if prepare(&stream).is_err() {
                continue;
            }
            if self.clients.len() >= MOST
                && let Some(silent) = self.longest_silent()
            {
                self.clients.remove(silent);
            }
            if self.clients.len() >= MOST + RESERVED {
                // It may have said what it came for.
                self.hear()?;
                self.clients.remove(MOST);
            }
            self.count += 1;
            self.clients.push(Client {
                number: self.count,
                stream,
                input: Input::default(),
                unsent: Vec::new(),
                error: None,
                heard: Instant::now(),
                late: None,
                waits: None,
                left: None,
            });
        }
        Ok(())
    }

    /// Of those that may do everything, but for the one with the orders.
    fn longest_silent(&self) -> Option<usize> {
        let has_orders = |client: &Client| self.owner.as_ref().is_some_and(|owner| owner.number == client.number);
        let silent = self.clients.iter().take(MOST).enumerate();
        let silent = silent.filter(|(_, client)| !has_orders(client) && client.heard.elapsed() >= SILENT);
        silent.max_by_key(|(_, client)| client.heard.elapsed()).map(|(index, _)| index)
    }

    fn may_order(&self, number: u64) -> bool {
        self.owner.as_ref().is_none_or(|owner| owner.number == number || owner.ordered.elapsed() >= IDLE)
    }

    /// Takes what clients sent. A stop among it is carried out at once.
    fn hear(&mut self) -> Result<(), ClientError> {
        for index in 0..self.clients.len() {
            let Some(client) = self.clients.get_mut(index) else { break };
            let number = client.number;
            let may_order = index < MOST && self.may_order(number);
            if self.clients[index].read(ROUND, may_order) {
                self.drop_moves(Some(number));
                self.carry_out(index)?;
            }
        }
        Ok(())
    }

    /// What clients sent until now moves nothing any more, in whatever buffer it is; `by` the one who stopped the machine only what it
    /// sent before that.
    fn drop_moves(&mut self, by: Option<u64>) {
        let mut stopped_again = false;
        for client in self.clients.iter_mut().filter(|client| Some(client.number) != by) {
            stopped_again |= client.read(DRAINED, false);
            client.drop_moves();
            client.late = Some(Instant::now());
        }
        if stopped_again {
            self.clients.iter_mut().for_each(Client::drop_moves);
        }
    }

    /// Carries out some of what a client sent.
    fn serve(&mut self, index: usize) -> Result<(), ClientError> {
        for _ in 0..TURN {
            if self.clients.get(index).and_then(|client| client.input.first()).is_some_and(Piece::is_order) {
                // It may have been overtaken.
                self.hear()?;
                self.stage.refresh()?;
            }
            if self.stage.was_stopped() {
                self.drop_moves(None);
            }
            if !self.carry_out(index)? {
                break;
            }
        }
        if let Some(client) = self.clients.get_mut(index) {
            client.write();
        }
        Ok(())
    }

    /// Carries out the command whose turn it is; whether there was one that does not have to wait.
    fn carry_out(&mut self, index: usize) -> Result<bool, ClientError> {
        let Some(client) = self.clients.get(index).filter(|client| client.is_ready()) else { return Ok(false) };
        let Some(piece) = client.input.first().cloned() else { return Ok(false) };
        let may_order = self.may_order(client.number);
        let Some(client) = self.clients.get_mut(index) else { return Ok(false) };
        let is_crowd = index >= MOST && !piece.is_stop() && piece != Piece::Line("ERR?".to_owned());
        let mut asked = Asked { axes: &self.axes, error: &mut client.error, may_order };
        let done = if is_crowd { Err(Code::NotNow.into()) } else { execute(&mut self.stage, &mut asked, &piece) };
        match done {
            Err(No::Link(error)) => return Err(error),
            // What it is not there to see is not done later.
            Err(No::Later) if client.left.is_some() => client.error = Some(Code::NotNow),
            Err(No::Later) if client.waits.get_or_insert_with(Instant::now).elapsed() < PATIENCE => return Ok(false),
            Err(No::Later) => client.error = Some(Code::NotNow),
            Err(No::Code(code)) => client.error = Some(code),
            Ok(answer) => {
                if may_order && piece.is_order() {
                    self.owner = Some(Owner { number: client.number, ordered: Instant::now() });
                }
                client.say(answer.as_deref());
            }
        }
        client.waits = None;
        client.input.done();
        if client.error.is_none() && client.input.first().is_none() {
            client.late = None;
        }
        Ok(true)
    }

    /// Clients that have gone leave the orders; what they asked for is done, and the platform stays there.
    fn part(&mut self) {
        self.clients.retain(Client::is_there);
        let is_there = |owner: &Owner| self.clients.iter().any(|client| client.number == owner.number);
        if !self.owner.as_ref().is_some_and(is_there) {
            self.owner = None;
        }
    }
}

/// As a client is served: without waiting, and its answers, which are short and waited for, at once.
fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    sockopt::set_socket_keepalive(stream, true)?;
    sockopt::set_tcp_keepidle(stream, KEEP_ALIVE)?;
    sockopt::set_tcp_keepintvl(stream, KEEP_ALIVE / 3)?;
    Ok(sockopt::set_tcp_keepcnt(stream, 3)?)
}

impl Client {
    /// Whether a command of it may be carried out: it reads what it is answered.
    fn is_ready(&self) -> bool {
        self.input.first().is_some_and(|piece| piece.is_stop() || self.unsent.len() < UNREAD)
    }

    /// Whether there is anything left to do for it. One that only listens gets its answers.
    fn is_there(&self) -> bool {
        let waits = self.input.first().is_some() || !self.unsent.is_empty();
        self.left.is_none_or(|left| waits && left.elapsed() < GOODBYE)
    }

    fn leave(&mut self) {
        self.left.get_or_insert_with(Instant::now);
    }

    /// Takes what it sent, at most about so many bytes; whether a stop is among it.
    fn read(&mut self, most: usize, may_order: bool) -> bool {
        let (mut bytes, mut taken, mut stops) = ([0; PART], 0, false);
        while self.left.is_none() && taken < most {
            match self.stream.read(&mut bytes) {
                Ok(0) => self.leave(),
                Ok(count) => {
                    taken += count;
                    stops |= self.input.push(&bytes[..count], may_order);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => self.leave(),
            }
        }
        if taken > 0 {
            self.heard = Instant::now();
            self.acknowledge();
        }
        let has_paused = taken == 0 && self.heard.elapsed() >= PAUSE;
        self.late.take_if(|since| has_paused || since.elapsed() >= LATE);
        if self.late.is_some() && !stops {
            self.drop_moves();
        }
        self.tell_dropped();
        stops
    }

    fn drop_moves(&mut self) {
        self.input.drop_moves();
        self.tell_dropped();
    }

    fn tell_dropped(&mut self) {
        if self.input.has_dropped() {
            (self.error, self.waits) = (Some(Code::Stopped), None);
        }
    }

    /// Lets the system acknowledge what was read at once. It would wait for an answer to do it with, and a command that has none keeps a
    /// client without `TCP_NODELAY` from sending its next one for 40 ms.
    fn acknowledge(&self) {
        #[cfg(target_os = "linux")]
        let _ = sockopt::set_tcp_quickack(&self.stream, true);
    }

    /// An answer, of bytes as the wire has them.
    fn say(&mut self, answer: Option<&str>) {
        if let Some(text) = answer {
            self.unsent.extend(text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap_or(b'?')));
            self.unsent.push(b'\n');
        }
    }

    fn write(&mut self) {
        while !self.unsent.is_empty() {
            match self.stream.write(&self.unsent) {
                Ok(count) => {
                    self.unsent.drain(..count);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => {
                    self.unsent.clear();
                    self.leave();
                }
            }
        }
    }
}
