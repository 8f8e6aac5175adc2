//! The device's side of the link.

use crate::counters::{Counters, count};
use crate::frame::{self, FRAME, Frame, Header, Kind, VERSION};
use crate::message::{Refusal, Reply, Request, Status};
use crate::receiver::Receiver;

/// Carries out requests: the program around a controller.
pub trait Device {
    /// Carries out a request, or refuses it and changes nothing. Never called twice for one request.
    ///
    /// [`Status::link`] of an answer is filled in by the endpoint.
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_>;
}

/// A session and its last request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Session {
    number: u16,
    sequence: u16,
}

/// Longest frame of a refusal: header, three bytes, CRC, and COBS overhead.
const REFUSAL: usize = 24;

/// Takes bytes from the host and returns the answers to send, at most one for each byte.
pub struct Endpoint {
    receiver: Receiver,
    session: Option<Session>,
    /// The last answer, kept for a repeated request.
    reply: Frame,
    /// Other answers, so that the last answer is kept.
    refusal: Frame<REFUSAL>,
    counters: Counters,
}

impl Default for Endpoint {
    fn default() -> Self {
        Self::new()
    }
}

impl Endpoint {
    /// Without a session.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            session: None,
            reply: Frame::EMPTY,
            refusal: Frame::EMPTY,
            counters: Counters::NONE,
        }
    }

    /// The counters.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Takes a byte from the host. If it ends a request, `device` carries it out, and the returned bytes are the answer
    /// to send.
    ///
    /// `dyn` and not inlined, so that there is one copy, compiled with this crate's options.
    #[inline(never)]
    pub fn push(&mut self, byte: u8, device: &mut dyn Device) -> Option<&[u8]> {
        let (header, message) = match self.receiver.push(byte)? {
            Ok(whole) => whole,
            Err(damage) => {
                self.counters.damaged(damage);
                return None;
            }
        };
        // In a future version all but the first byte may have another meaning.
        if header.version != VERSION {
            count(&mut self.counters.version);
            return refuse(&mut self.refusal, &header, Refusal::Version);
        }
        if header.kind != Kind::Request {
            count(&mut self.counters.kind);
            return None;
        }
        let Some(request) = frame::message::<Request<'_>>(message) else {
            count(&mut self.counters.message);
            return refuse(&mut self.refusal, &header, Refusal::Message);
        };
        let this = Session { number: header.session, sequence: header.sequence };
        if self.session == Some(this) {
            count(&mut self.counters.repeated);
            return Some(self.reply.bytes());
        }
        match self.session.filter(|last| last.number == this.number) {
            Some(last) if this.sequence != last.sequence.wrapping_add(1) || request == Request::Hello => {
                count(&mut self.counters.sequence);
                return refuse(&mut self.refusal, &header, Refusal::Sequence);
            }
            None if request != Request::Hello => {
                count(&mut self.counters.session);
                return refuse(&mut self.refusal, &header, Refusal::NoSession);
            }
            _ => {}
        }
        self.session = Some(this);
        count(&mut self.counters.executed);
        let mut reply = device.execute(&request);
        if let Reply::Status(status) = &mut reply {
            status.link = self.counters;
        }
        let header = Header { kind: Kind::Reply, ..header };
        if !self.reply.set(&header, &reply) {
            self.reply.set(&header, &Reply::Refused(Refusal::TooLong));
        }
        Some(self.reply.bytes())
    }
}

fn refuse<'a>(frame: &'a mut Frame<REFUSAL>, header: &Header, refusal: Refusal) -> Option<&'a [u8]> {
    let header = Header { version: VERSION, kind: Kind::Reply, ..*header };
    frame.set(&header, &Reply::Refused(refusal)).then(|| frame.bytes())
}

/// Writes a frame of telemetry with the status of the device; returns its bytes.
#[must_use]
pub fn telemetry<'a>(status: &Status, sequence: u16, out: &'a mut [u8; FRAME]) -> &'a [u8] {
    let header = Header { version: VERSION, kind: Kind::Telemetry, session: 0, sequence };
    let length = frame::encode(&header, status, out).unwrap_or(0);
    out.get(..length).unwrap_or_default()
}
