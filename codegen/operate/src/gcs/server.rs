//! Clients over TCP: many may query, one is in control, any may stop the machine, and none can block it.
//!
//! ```text
//! round: poll the machine, if due ─► read some bytes of each client ─► stops ─► commands, one of each client in turn
//! ```
//! A round takes milliseconds, whatever clients send. A stop is executed in the round in which it is read. A command that needs
//! control waits until everything sent by its client was read, so that a stop overtakes it.

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

/// Number of clients with full access.
const MOST: usize = 16;
/// Additional clients, which may only stop the machine until one of the others leaves or is disconnected.
const RESERVED: usize = 4;
/// Connections accepted per round.
const TAKEN: usize = 4;
/// Bytes read per round from all clients together, and at least from each.
const ROUND: usize = 1 << 15;
const PART: usize = 1 << 12;
/// Commands executed per client and round, and the time limit for those of all clients.
const TURN: usize = 32;
const SLICE: Duration = Duration::from_millis(2);
/// The machine is polled this long before it is due, because a round may be in progress.
const EARLY: Duration = Duration::from_millis(5);
/// Bytes of answers that a client may leave unread before its commands wait.
const UNREAD: usize = 1 << 16;
/// How long a command may wait for a machine that is starting or coming to rest.
const PATIENCE: Duration = Duration::from_secs(12);
/// A client in control loses control to the next client if it has sent no command for this time.
const IDLE: Duration = Duration::from_secs(60);
/// A client that was silent for this time can be disconnected to make room for another.
const SILENT: Duration = Duration::from_secs(5);
/// Idle time before a keep-alive probe; a connection that does not answer for as long again is closed.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// After a stop by another client, what a client sends counts as sent before the stop, until it pauses for `PAUSE` or has read
/// the error, and for `LATE` at most once everything that it sent was read.
const PAUSE: Duration = Duration::from_millis(50);
const LATE: Duration = Duration::from_secs(1);
/// How long a client that has closed its side may take to read answers.
const GOODBYE: Duration = Duration::from_secs(2);
/// Polling interval during a motion or a wait.
const SOON: Duration = Duration::from_millis(1);

struct Client {
    number: u64,
    stream: TcpStream,
    input: Input,
    /// Everything that it sent was read.
    is_dry: bool,
    unsent: Vec<u8>,
    error: Option<Code>,
    /// When it last sent something.
    heard: Instant,
    /// When another client stopped the machine, while later input may have been sent before that.
    late: Option<Instant>,
    /// Since when its next command waits for the machine.
    waits: Option<Instant>,
    /// When it closed its side.
    left: Option<Instant>,
}

/// The client in control, and the time of its last command.
struct Owner {
    number: u64,
    last_command: Instant,
}

/// A server that lets GCS clients move a machine.
pub struct Bridge<P> {
    stage: Stage<P>,
    axes: Axes,
    listener: TcpListener,
    clients: Vec<Client>,
    owner: Option<Owner>,
    /// Number of clients so far.
    count: u64,
    /// Index of the client that was served last.
    turn: usize,
    /// Clients were read since the last command that needs control.
    has_heard: bool,
}

impl<P: Port> Bridge<P> {
    /// A server of a machine for clients of a listener.
    ///
    /// # Errors
    /// The listener cannot be set to non-blocking mode.
    pub fn new(stage: Stage<P>, axes: Axes, listener: TcpListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { stage, axes, listener, clients: Vec::new(), owner: None, count: 0, turn: 0, has_heard: false })
    }

    /// Serves until `stop`, and polls the machine. `look` is called after each poll.
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

    /// Polls the machine if it is due, or often during a motion.
    fn look(&mut self, look: &mut impl FnMut(&Session<P>)) -> Result<(), ClientError> {
        if self.due().is_zero() || self.is_pressed() && self.stage.age() >= SOON {
            self.stage.look()?;
        }
        look(self.stage.session());
        Ok(())
    }

    /// Time until the machine must be polled.
    fn due(&self) -> Duration {
        self.stage.due().saturating_sub(EARLY)
    }

    /// Returns the session.
    pub fn into_session(self) -> Session<P> {
        self.stage.into_session()
    }

    /// Whether the machine must be polled often: a motion, or a command that waits.
    fn is_pressed(&self) -> bool {
        self.stage.moves() || self.clients.iter().any(|client| client.waits.is_some())
    }

    /// Waits until a client sends something or can take an answer, or the machine must be polled.
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
            // A client with unread input must not shorten the wait.
            if client.left.is_none() && client.is_dry {
                flags |= PollFlags::IN;
            }
            if !client.unsent.is_empty() {
                flags |= PollFlags::OUT;
            }
            files.push(PollFd::from_borrowed_fd(client.stream.as_fd(), flags));
        }
        // A signal ends the wait early. After any other error, the next round tries again.
        match Timespec::try_from(limit).map(|limit| poll(&mut files, Some(&limit))) {
            Ok(Ok(_) | Err(Errno::INTR)) => {}
            _ => std::thread::sleep(SOON),
        }
    }

    /// Accepts connections. A client always gets in: it replaces one that has long been silent, or may only stop the machine.
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
                // Its input may contain a stop, so execute it before it is disconnected.
                self.hear_from(MOST);
                for _ in 0..TURN {
                    self.execute_next(MOST)?;
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

    /// The client with full access that has been silent longest, except the one in control.
    fn longest_silent(&self) -> Option<usize> {
        let is_owner = |client: &Client| self.owner.as_ref().is_some_and(|owner| owner.number == client.number);
        let silent = self.clients.iter().take(MOST).enumerate();
        let silent = silent.filter(|(_, client)| !is_owner(client) && client.heard.elapsed() >= SILENT);
        silent.max_by_key(|(_, client)| client.heard.elapsed()).map(|(index, _)| index)
    }

    fn may_control(&self, number: u64) -> bool {
        self.owner.as_ref().is_none_or(|owner| owner.number == number || owner.last_command.elapsed() >= IDLE)
    }

    /// Reads some input of each client.
    fn hear(&mut self) {
        for index in 0..self.clients.len() {
            self.hear_from(index);
        }
        self.has_heard = true;
    }

    fn hear_from(&mut self, index: usize) {
        let number = self.clients[index].number;
        let may_control = index < MOST && self.may_control(number);
        let most = (ROUND / self.clients.len()).max(PART);
        if self.clients[index].read(most, may_control) {
            self.stage.must_stop();
            self.drop_moves(Some(number));
        }
    }

    /// Discards moves that clients have sent so far, even if they are still in a buffer. `by` is the client that stopped the
    /// machine; its moves before the stop are already discarded.
    fn drop_moves(&mut self, by: Option<u64>) {
        for client in self.clients.iter_mut().filter(|client| Some(client.number) != by) {
            client.input.drop_moves();
            (client.late, client.is_dry) = (Some(Instant::now()), false);
        }
    }

    /// Whether the machine was stopped, but not by a client.
    fn was_stopped(&mut self) -> bool {
        let was_stopped = self.stage.was_stopped();
        if was_stopped {
            self.drop_moves(None);
        }
        was_stopped
    }

    /// Executes stops, then one command of each client in turn until the time is up.
    fn serve(&mut self) -> Result<(), ClientError> {
        let (start, count) = (Instant::now(), self.clients.len());
        self.was_stopped();
        for index in 0..count {
            if self.clients[index].input.has_stop() {
                self.execute_next(index)?;
            }
        }
        let mut idle = 0;
        for _ in 0..TURN * count {
            self.turn = (self.turn + 1) % count;
            idle = if self.execute_next(self.turn)? { 0 } else { idle + 1 };
            if idle == count || start.elapsed() >= SLICE {
                break;
            }
        }
        self.clients.iter_mut().for_each(Client::write);
        Ok(())
    }

    /// Executes the next command of a client. Returns false if there is none, or it has to wait.
    fn execute_next(&mut self, index: usize) -> Result<bool, ClientError> {
        if !self.clients[index].skip() {
            return Ok(true);
        }
        let client = &self.clients[index];
        let Some(piece) = client.input.first().filter(|_| client.is_ready()).cloned() else { return Ok(false) };
        let may_control = self.may_control(client.number);
        if may_control && piece.needs_control() && !client.input.has_stop() {
            // A stop may have overtaken it.
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
        let mut asked = ClientContext { axes: &self.axes, error: &mut client.error, may_control };
        let done = if is_crowd { Err(Code::NotNow.into()) } else { execute(&mut self.stage, &mut asked, &piece) };
        match done {
            Err(Rejection::Link(error)) => return Err(error),
            // If the client has gone, do not execute its command later.
            Err(Rejection::Later) if client.left.is_some() => client.error = Some(Code::NotNow),
            Err(Rejection::Later) if client.waits.get_or_insert_with(Instant::now).elapsed() < PATIENCE => {
                return Ok(false);
            }
            Err(Rejection::Later) => client.error = Some(Code::NotNow),
            Err(Rejection::Code(code)) => client.error = Some(code),
            Ok(answer) => {
                if may_control && piece.needs_control() {
                    self.owner = Some(Owner { number: client.number, last_command: Instant::now() });
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

    /// Removes clients that have gone; one in control gives it up. Their motions end normally.
    fn part(&mut self) {
        self.clients.retain(Client::is_there);
        let is_there = |owner: &Owner| self.clients.iter().any(|client| client.number == owner.number);
        if !self.owner.as_ref().is_some_and(is_there) {
            self.owner = None;
        }
    }
}

/// Sets the options of a connection: non-blocking, answers without delay, keep-alive.
fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    sockopt::set_socket_keepalive(stream, true)?;
    sockopt::set_tcp_keepidle(stream, KEEP_ALIVE)?;
    sockopt::set_tcp_keepintvl(stream, KEEP_ALIVE / 3)?;
    Ok(sockopt::set_tcp_keepcnt(stream, 3)?)
}

impl Client {
    /// Whether its next command may be executed: it reads its answers, and no unread stop can overtake the command.
    fn is_ready(&self) -> bool {
        let may = |piece: &Piece| self.unsent.len() < UNREAD && (self.is_dry || !piece.needs_control());
        self.input.has_stop() || self.input.first().is_some_and(may)
    }

    /// Whether it is connected, or still gets answers after it closed its side.
    fn is_there(&self) -> bool {
        let waits = self.input.first().is_some() || !self.unsent.is_empty();
        self.left.is_none_or(|left| waits && left.elapsed() < GOODBYE)
    }

    fn leave(&mut self) {
        self.left.get_or_insert_with(Instant::now);
    }

    /// Reads at most `most` bytes. Returns whether they contain a stop.
    fn read(&mut self, most: usize, may_control: bool) -> bool {
        let (mut bytes, mut taken, mut stops) = ([0; ROUND], 0, false);
        if self.left.is_none() {
            match self.stream.read(&mut bytes[..most]) {
                Ok(0) => self.leave(),
                Ok(count) => {
                    taken = count;
                    self.heard = Instant::now();
                    stops = self.input.push(&bytes[..count], may_control);
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

    /// Skips discarded moves; false if there are more.
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

    /// Makes the system acknowledge received data immediately. Otherwise it waits for an answer, and a command without one delays
    /// the next command of a client without `TCP_NODELAY` by 40 ms.
    fn acknowledge(&self) {
        #[cfg(target_os = "linux")]
        let _ = sockopt::set_tcp_quickack(&self.stream, true);
    }

    /// Queues an answer, one byte per character.
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
