//! Browsers: a thread each passes messages to the thread that has the machine, and back. A slow browser is left behind.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use super::http::Guard;

/// Most pages at a time; one more is refused.
const MOST: usize = 32;
/// Connections at a time that have not shown the token; the oldest makes room for the next.
const STRANGERS: usize = 64;
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

/// An event of a page, for the thread that has the machine.
pub enum ClientEvent {
    Connected { page: u64, to: Outbox },
    Received { page: u64, text: String },
    Disconnected { page: u64 },
}

/// The queue of messages to a page.
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

/// Connections that have not shown the token, the oldest first, by number.
type Strangers = Arc<Mutex<VecDeque<(u64, TcpStream)>>>;

/// Lets browsers in, until the process ends. Each has a thread. One that is slow to say what it wants keeps nobody out.
pub fn serve(listener: TcpListener, guard: Guard, page: String, events: SyncSender<ClientEvent>) {
    let (guard, page) = (Arc::new(guard), Arc::<str>::from(page));
    let (there, strangers) = (Arc::new(AtomicUsize::new(0)), Strangers::default());
    std::thread::spawn(move || {
        for (stream, number) in listener.incoming().zip(1..) {
            let Ok((stream, other)) = stream.and_then(|stream| Ok((stream.try_clone()?, stream))) else {
                std::thread::sleep(REST);
                continue;
            };
            {
                let mut strangers = strangers.lock().unwrap_or_else(PoisonError::into_inner);
                strangers.push_back((number, other));
                if strangers.len() > STRANGERS
                    && let Some((_, oldest)) = strangers.pop_front()
                {
                    let _ = oldest.shutdown(Shutdown::Both);
                }
            }
            let (guard, page, events) = (guard.clone(), page.clone(), events.clone());
            let (there, strangers) = (there.clone(), strangers.clone());
            std::thread::spawn(move || {
                let admitted = guard.admit(stream, &page, || {
                    strangers.lock().unwrap_or_else(PoisonError::into_inner).retain(|(known, _)| *known != number);
                });
                // A browser that goes away is no news but to the one who has the machine.
                if let Ok(Some(stream)) = admitted {
                    if there.fetch_add(1, Ordering::Relaxed) < MOST {
                        let _ = talk(stream, number, &events);
                        let _ = events.send(ClientEvent::Disconnected { page: number });
                    }
                    there.fetch_sub(1, Ordering::Relaxed);
                }
            });
        }
    });
}

/// Until either side ends it.
fn talk(stream: TcpStream, page: u64, events: &SyncSender<ClientEvent>) -> Result<(), Error> {
    let (woken, wake) = UnixStream::pair()?;
    woken.set_nonblocking(true)?;
    wake.set_nonblocking(true)?;
    stream.set_read_timeout(Some(REST))?;
    let (messages, queue) = sync_channel(QUEUE);
    let gone = || Error::Io(ErrorKind::BrokenPipe.into());
    events.send(ClientEvent::Connected { page, to: Outbox { messages, wake } }).map_err(|_| gone())?;
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
                    let event = ClientEvent::Received { page, text: text.as_str().to_owned() };
                    events.send(event).map_err(|_| gone())?;
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
