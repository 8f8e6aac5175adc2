//! Browsers: one thread each exchanges messages with the thread that operates the machine. A slow browser delays no other.

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

/// Largest number of pages; more are refused.
const MOST: usize = 32;
/// Largest number of connections without a token; the oldest is closed for the next.
const STRANGERS: usize = 64;
/// Length of a page's queue of messages; more are dropped.
const QUEUE: usize = 64;
/// Largest message of a page, bytes: a wave in its file.
const LARGEST: usize = 1 << 16;
/// Messages read from a page per round.
const ROUND: usize = 32;
/// Timeout of a wait for events.
const IDLE: Timespec = Timespec { tv_sec: 1, tv_nsec: 0 };
/// Timeout of a read, for the rest of a frame.
const REST: Duration = Duration::from_millis(1);

/// An event of a page, for the thread that operates the machine.
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
    /// Sends without waiting. Returns whether there was room.
    pub fn send(&self, message: Message) -> bool {
        let sent = !matches!(self.messages.try_send(message), Err(TrySendError::Full(_)));
        // If the pipe is full, the thread wakes anyway.
        let _ = (&self.wake).write(&[0]);
        sent
    }
}

/// Connections without a token, by number, oldest first.
type Strangers = Arc<Mutex<VecDeque<(u64, TcpStream)>>>;

/// Accepts browsers until the process ends, each in its own thread, so that a slow handshake does not block others.
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
                // A browser that disconnects is not an error here; the other thread gets the event.
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

/// Exchanges messages until either side closes the connection.
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
        // A signal ends the wait early; the next round continues.
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
