//! One browser: what it says goes to the thread that has the machine, what that publishes goes to it. A slow one is left behind.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use super::http::Guard;

/// Pages at a time; one more is turned away.
const MOST: usize = 32;
/// Messages that wait for a page before more are dropped.
const QUEUE: usize = 64;
/// Largest message of a page, bytes: a wave in its file.
const LARGEST: usize = 1 << 16;
/// Messages that are taken from a page in a round.
const ROUND: usize = 32;
/// How long it sleeps where nothing happens.
const IDLE: Timespec = Timespec { tv_sec: 1, tv_nsec: 0 };
/// How long reading waits for the rest of a frame.
const REST: Duration = Duration::from_millis(1);

/// What the thread that has the machine hears of pages.
pub enum Heard {
    Came { page: u64, to: Outbox },
    Said { page: u64, text: String },
    Left { page: u64 },
}

/// The way to a page.
pub struct Outbox {
    messages: SyncSender<Message>,
    wake: UnixStream,
}

impl Outbox {
    /// Sends without waiting; whether there was room.
    pub fn send(&self, message: Message) -> bool {
        let sent = !matches!(self.messages.try_send(message), Err(TrySendError::Full(_)));
        // Full, it wakes anyway.
        let _ = (&self.wake).write(&[0]);
        sent
    }
}

/// Lets browsers in, until the process ends. Each has a thread.
pub fn serve(listener: TcpListener, guard: Guard, page: String, heard: SyncSender<Heard>) {
    let (guard, page) = (Arc::new(guard), Arc::<str>::from(page));
    let (count, there) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicUsize::new(0)));
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(stream) = stream else {
                std::thread::sleep(REST);
                continue;
            };
            if there.load(Ordering::Relaxed) >= MOST {
                continue;
            }
            there.fetch_add(1, Ordering::Relaxed);
            let (guard, page, heard) = (guard.clone(), page.clone(), heard.clone());
            let (count, there) = (count.clone(), there.clone());
            std::thread::spawn(move || {
                // A browser that goes away is no news but to the one who has the machine.
                if let Ok(Some(stream)) = guard.admit(stream, &page) {
                    let number = count.fetch_add(1, Ordering::Relaxed) + 1;
                    let _ = talk(stream, number, &heard);
                    let _ = heard.send(Heard::Left { page: number });
                }
                there.fetch_sub(1, Ordering::Relaxed);
            });
        }
    });
}

/// Until either side ends it.
fn talk(stream: TcpStream, page: u64, heard: &SyncSender<Heard>) -> Result<(), Error> {
    let (woken, wake) = UnixStream::pair()?;
    woken.set_nonblocking(true)?;
    wake.set_nonblocking(true)?;
    stream.set_read_timeout(Some(REST))?;
    let (messages, queue) = sync_channel(QUEUE);
    let gone = || Error::Io(ErrorKind::BrokenPipe.into());
    heard.send(Heard::Came { page, to: Outbox { messages, wake } }).map_err(|_| gone())?;
    let config = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
    loop {
        let mut files = [PollFd::new(socket.get_ref(), PollFlags::IN), PollFd::new(&woken, PollFlags::IN)];
        // A signal ends it early: there is a next round.
        let _ = poll(&mut files, Some(&IDLE));
        drain(&woken);
        deliver(&queue, &mut socket)?;
        for _ in 0..ROUND {
            match socket.read() {
                Ok(Message::Text(text)) => {
                    let said = Heard::Said { page, text: text.as_str().to_owned() };
                    heard.send(said).map_err(|_| gone())?;
                }
                Ok(Message::Close(_)) => return Ok(()),
                Ok(_) => {}
                Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => break,
                Err(error) => return Err(error),
            }
        }
    }
}

fn drain(mut woken: &UnixStream) {
    let mut bytes = [0; 256];
    while matches!(woken.read(&mut bytes), Ok(count) if count == bytes.len()) {}
}

fn deliver(queue: &Receiver<Message>, socket: &mut WebSocket<TcpStream>) -> Result<(), Error> {
    loop {
        match queue.try_recv() {
            Ok(message) => socket.write(message)?,
            Err(TryRecvError::Empty) => return socket.flush(),
            Err(TryRecvError::Disconnected) => {
                socket.flush()?;
                socket.close(None)?;
                socket.flush()?;
                return Err(Error::Io(ErrorKind::BrokenPipe.into()));
            }
        }
    }
}
