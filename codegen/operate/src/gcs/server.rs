//! Clients over TCP: many may query, one is in control, any may stop the machine, and none keeps it waiting.
//!
//! ```text
//! round: look at the machine, if it is due ─► read a part from each client ─► stops ─► commands, one of each client in turn
//! ```
//! A round takes milliseconds, whatever clients send. A stop is carried out in the round in which it is read. An order waits until
//! everything that its client has sent was read: a stop among it overtakes all of it.

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
use super::commands::{ClientContext, execute};
use super::input::{Input, Piece};
use super::stage::{Rejection, Stage};
use crate::session::Session;

/// Clients at a time that may do everything.
const MOST: usize = 16;
/// Clients beyond that may only stop the machine, until one of the others leaves or has to make room.
const RESERVED: usize = 4;
/// Connections that are taken in a round.
const TAKEN: usize = 4;
/// Bytes that are read in a round from all clients together, and from each of them if they are many.
const ROUND: usize = 1 << 15;
const PART: usize = 1 << 12;
/// Commands of a client that are carried out in a round, and how long those of all clients may take.
const TURN: usize = 32;
const SLICE: Duration = Duration::from_millis(2);
/// So long before it is due the machine is looked at: a round may be under way.
const EARLY: Duration = Duration::from_millis(5);
/// Bytes that a client may leave unread before its commands wait.
const UNREAD: usize = 1 << 16;
/// How long a command may wait for a machine that comes up or to rest.
const PATIENCE: Duration = Duration::from_secs(12);
/// A client in control that has sent no command for so long loses control to the next that sends one.
const IDLE: Duration = Duration::from_secs(60);
/// A client that has been silent for so long makes room for one for whom there is none.
const SILENT: Duration = Duration::from_secs(5);
/// A connection without a sign of life for so long is looked after, and closed if it stays so for as long again.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// What comes from a client after a stop of another was sent before it, until the client pauses for so long or has been told, and for so
/// long at most once everything that it has sent was read.
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
    /// Everything that had come from it was read.
    is_dry: bool,
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

/// The client in control, and its last command.
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
    /// The client that was served last.
    turn: usize,
    /// Clients were heard since the last order.
    has_heard: bool,
}

impl<P: Port> Bridge<P> {
    /// Of a machine, for clients of a listener.
    ///
    /// # Errors
    /// What the system says.
    pub fn new(stage: Stage<P>, axes: Axes, listener: TcpListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { stage, axes, listener, clients: Vec::new(), owner: None, count: 0, turn: 0, has_heard: false })
    }

    /// Serves until `stop`. The machine is looked at in between, and told to `look` at.
    ///
    /// # Errors
    /// The link to the machine broke.
    pub fn run(&mut self, stop: &AtomicBool, mut look: impl FnMut(&Session<P>)) -> Result<(), ClientError> {
        while !stop.load(Ordering::Relaxed) {
            self.wait();
            self.accept()?;
            self.look(&mut look)?;
            self.hear();
            self.part();
            self.look(&mut look)?;
            self.serve()?;
        }
        Ok(())
    }

    /// Looks at the machine if it is due, or something is under way.
    fn look(&mut self, look: &mut impl FnMut(&Session<P>)) -> Result<(), ClientError> {
        if self.due().is_zero() || self.is_pressed() && self.stage.age() >= SOON {
            self.stage.look()?;
        }
        look(self.stage.session());
        Ok(())
    }

    /// Time until the machine has to be looked at.
    fn due(&self) -> Duration {
        self.stage.due().saturating_sub(EARLY)
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
        let is_soon = self.is_pressed() || self.clients.iter().any(|client| !client.is_dry);
        let has_work = self.clients.iter().any(|client| client.waits.is_none() && client.is_ready());
        let limit = match self.due() {
            _ if has_work => Duration::ZERO,
            due if is_soon && due > SOON => SOON,
            due => due,
        };
        let mut files = vec![PollFd::new(&self.listener, PollFlags::IN)];
        for client in &self.clients {
            let mut flags = PollFlags::empty();
            // One that sends more than is read in a round does not hurry the rounds.
            if client.left.is_none() && client.is_dry {
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
                self.hear_from(MOST);
                for _ in 0..TURN {
                    self.carry_out(MOST)?;
                }
                self.clients.remove(MOST).write();
            }
            self.count += 1;
            self.clients.push(Client {
                number: self.count,
                stream,
                input: Input::default(),
                is_dry: false,
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

    /// Of those that may do everything, but for the one in control.
    fn longest_silent(&self) -> Option<usize> {
        let has_orders = |client: &Client| self.owner.as_ref().is_some_and(|owner| owner.number == client.number);
        let silent = self.clients.iter().take(MOST).enumerate();
        let silent = silent.filter(|(_, client)| !has_orders(client) && client.heard.elapsed() >= SILENT);
        silent.max_by_key(|(_, client)| client.heard.elapsed()).map(|(index, _)| index)
    }

    fn may_order(&self, number: u64) -> bool {
        self.owner.as_ref().is_none_or(|owner| owner.number == number || owner.ordered.elapsed() >= IDLE)
    }

    /// Takes a part of what each client sent.
    fn hear(&mut self) {
        for index in 0..self.clients.len() {
            self.hear_from(index);
        }
        self.has_heard = true;
    }

    fn hear_from(&mut self, index: usize) {
        let number = self.clients[index].number;
        let may_order = index < MOST && self.may_order(number);
        let most = (ROUND / self.clients.len()).max(PART);
        if self.clients[index].read(most, may_order) {
            self.stage.must_stop();
            self.drop_moves(Some(number));
        }
    }

    /// What clients sent until now moves nothing any more, in whatever buffer it is; `by` the one who stopped the machine only what it
    /// sent before that.
    fn drop_moves(&mut self, by: Option<u64>) {
        for client in self.clients.iter_mut().filter(|client| Some(client.number) != by) {
            client.input.drop_moves();
            (client.late, client.is_dry) = (Some(Instant::now()), false);
        }
    }

    /// Whether another than a client has stopped the machine.
    fn was_stopped(&mut self) -> bool {
        let was_stopped = self.stage.was_stopped();
        if was_stopped {
            self.drop_moves(None);
        }
        was_stopped
    }

    /// Carries out some of what clients sent: stops, then one command of each client in turn until the time is up.
    fn serve(&mut self) -> Result<(), ClientError> {
        let (start, count) = (Instant::now(), self.clients.len());
        self.was_stopped();
        for index in 0..count {
            if self.clients[index].input.has_stop() {
                self.carry_out(index)?;
            }
        }
        let mut idle = 0;
        for _ in 0..TURN * count {
            self.turn = (self.turn + 1) % count;
            idle = if self.carry_out(self.turn)? { 0 } else { idle + 1 };
            if idle == count || start.elapsed() >= SLICE {
                break;
            }
        }
        self.clients.iter_mut().for_each(Client::write);
        Ok(())
    }

    /// Carries out the command whose turn it is; whether there was one that does not have to wait.
    fn carry_out(&mut self, index: usize) -> Result<bool, ClientError> {
        if !self.clients[index].skip() {
            return Ok(true);
        }
        let client = &self.clients[index];
        let Some(piece) = client.input.first().filter(|_| client.is_ready()).cloned() else { return Ok(false) };
        let may_order = self.may_order(client.number);
        if may_order && piece.is_order() && !client.input.has_stop() {
            // It may have been overtaken.
            if !self.has_heard {
                return Ok(false);
            }
            self.stage.refresh()?;
            if self.was_stopped() {
                return Ok(false);
            }
            self.has_heard = false;
        }
        let client = &mut self.clients[index];
        let is_crowd = index >= MOST && !piece.is_stop() && piece != Piece::Line("ERR?".to_owned());
        let mut asked = ClientContext { axes: &self.axes, error: &mut client.error, may_order };
        let done = if is_crowd { Err(Code::NotNow.into()) } else { execute(&mut self.stage, &mut asked, &piece) };
        match done {
            Err(Rejection::Link(error)) => return Err(error),
            // What it is not there to see is not done later.
            Err(Rejection::Later) if client.left.is_some() => client.error = Some(Code::NotNow),
            Err(Rejection::Later) if client.waits.get_or_insert_with(Instant::now).elapsed() < PATIENCE => {
                return Ok(false);
            }
            Err(Rejection::Later) => client.error = Some(Code::NotNow),
            Err(Rejection::Code(code)) => client.error = Some(code),
            Ok(answer) => {
                if may_order && piece.is_order() {
                    self.owner = Some(Owner { number: client.number, ordered: Instant::now() });
                }
                client.say(answer.as_deref());
            }
        }
        client.waits = None;
        client.input.done();
        if client.error.is_none() && client.is_dry && client.input.first().is_none() {
            client.late = None;
        }
        Ok(true)
    }

    /// Clients that have gone give up control; what they asked for is done, and the platform stays there.
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
    /// Whether a command of it may be carried out: it reads what it is answered, and no stop can be behind an order of it.
    fn is_ready(&self) -> bool {
        let may = |piece: &Piece| self.unsent.len() < UNREAD && (self.is_dry || !piece.is_order());
        self.input.has_stop() || self.input.first().is_some_and(may)
    }

    /// Whether there is anything left to do for it. One that only listens gets its answers.
    fn is_there(&self) -> bool {
        let waits = self.input.first().is_some() || !self.unsent.is_empty();
        self.left.is_none_or(|left| waits && left.elapsed() < GOODBYE)
    }

    fn leave(&mut self) {
        self.left.get_or_insert_with(Instant::now);
    }

    /// Takes at most so many bytes of what it sent; whether a stop is among them.
    fn read(&mut self, most: usize, may_order: bool) -> bool {
        let (mut bytes, mut taken, mut stops) = ([0; ROUND], 0, false);
        if self.left.is_none() {
            match self.stream.read(&mut bytes[..most]) {
                Ok(0) => self.leave(),
                Ok(count) => {
                    taken = count;
                    self.heard = Instant::now();
                    stops = self.input.push(&bytes[..count], may_order);
                    self.acknowledge();
                }
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
                Err(_) => self.leave(),
            }
        }
        let is_dry = taken < most;
        self.is_dry = is_dry;
        let has_paused = taken == 0 && self.heard.elapsed() >= PAUSE;
        self.late.take_if(|since| has_paused || is_dry && since.elapsed() >= LATE);
        if self.late.is_some() && !stops {
            self.input.drop_moves();
        }
        self.tell_dropped();
        stops
    }

    /// Passes over what a stop has taken away; false if there is more of it.
    fn skip(&mut self) -> bool {
        let is_over = self.input.skip();
        self.tell_dropped();
        is_over
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
