//! Clients over TCP: many may ask, one has the orders, and none keeps the machine waiting.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use specgen_link::client::{ClientError, Port};

use super::axes::Axes;
use super::code::Code;
use super::commands::{Asked, execute, is_order};
use super::input::Input;
use super::stage::{No, Stage};
use crate::session::Session;

/// Clients at a time; one more is turned away.
const MOST: usize = 16;
/// Bytes that are read from a client in a round.
const ROUND: usize = 4096;
/// Commands of a client that are carried out in a round.
const TURN: usize = 32;
/// Bytes that a client may leave unread before it is not listened to.
const UNREAD: usize = 1 << 16;
/// How long a command may wait for a machine that comes up or to rest.
const PATIENCE: Duration = Duration::from_secs(12);
/// A client that has ordered nothing for so long loses the orders to the next that orders.
const IDLE: Duration = Duration::from_secs(60);
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
            self.accept();
            if self.is_pressed() || self.stage.due().is_zero() {
                self.stage.look()?;
                look(self.stage.session());
            }
            for index in 0..self.clients.len() {
                self.serve(index)?;
            }
            self.part();
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
        let has_work = self.clients.iter().any(|client| client.waits.is_none() && client.input.first().is_some());
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
            if client.listens() {
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

    fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            // Answers are short and waited for.
            if self.clients.len() < MOST && stream.set_nonblocking(true).and_then(|()| stream.set_nodelay(true)).is_ok()
            {
                self.count += 1;
                self.clients.push(Client {
                    number: self.count,
                    stream,
                    input: Input::default(),
                    unsent: Vec::new(),
                    error: None,
                    waits: None,
                    left: None,
                });
            }
        }
    }

    fn may_order(&self, number: u64) -> bool {
        self.owner.as_ref().is_none_or(|owner| owner.number == number || owner.ordered.elapsed() >= IDLE)
    }

    /// Takes what a client sent, and carries out some of it.
    fn serve(&mut self, index: usize) -> Result<(), ClientError> {
        if let Some(client) = self.clients.get_mut(index) {
            client.read();
        }
        for _ in 0..TURN {
            let Some(client) = self.clients.get(index) else { break };
            let Some(piece) = client.input.first().cloned() else { break };
            if client.unsent.len() >= UNREAD {
                break;
            }
            let may_order = self.may_order(client.number);
            let Some(client) = self.clients.get_mut(index) else { break };
            let mut asked = Asked { axes: &self.axes, error: &mut client.error, may_order };
            let done = execute(&mut self.stage, &mut asked, &piece);
            match done {
                Err(No::Link(error)) => return Err(error),
                // What it is not there to see is not done later.
                Err(No::Later) if client.left.is_some() => client.error = Some(Code::NotNow),
                Err(No::Later) if client.waits.get_or_insert_with(Instant::now).elapsed() < PATIENCE => break,
                Err(No::Later) => client.error = Some(Code::NotNow),
                Err(No::Code(code)) => client.error = Some(code),
                Ok(answer) => {
                    if may_order && is_order(&piece) {
                        self.owner = Some(Owner { number: client.number, ordered: Instant::now() });
                    }
                    client.say(answer.as_deref());
                }
            }
            client.waits = None;
            client.input.done();
        }
        if let Some(client) = self.clients.get_mut(index) {
            client.write();
        }
        Ok(())
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

impl Client {
    /// Whether it is read from: what it sent is looked at, and it looks at what it is told.
    fn listens(&self) -> bool {
        self.left.is_none() && !self.input.is_full() && self.unsent.len() < UNREAD
    }

    /// Whether there is anything left to do for it. One that only listens gets its answers.
    fn is_there(&self) -> bool {
        let waits = self.input.first().is_some() || !self.unsent.is_empty();
        self.left.is_none_or(|left| waits && left.elapsed() < GOODBYE)
    }

    fn leave(&mut self) {
        self.left.get_or_insert_with(Instant::now);
    }

    fn read(&mut self) {
        if !self.listens() {
            return;
        }
        let mut bytes = [0; ROUND];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.leave(),
            Ok(count) => {
                self.input.push(&bytes[..count]);
                self.acknowledge();
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(_) => self.leave(),
        }
    }

    /// Lets the system acknowledge what was read at once. It would wait for an answer to do it with, and a command that has none keeps a
    /// client without `TCP_NODELAY` from sending its next one for 40 ms.
    fn acknowledge(&self) {
        #[cfg(target_os = "linux")]
        let _ = rustix::net::sockopt::set_tcp_quickack(&self.stream, true);
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
