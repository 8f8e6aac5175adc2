//! The host's side of the link.

use std::fmt;
use std::io;
use std::string::String;
use std::time::{Duration, Instant};
use std::vec::Vec;

use crate::frame::{self, Frame, Header, Kind, VERSION};
use crate::message::{Identity, Refusal, Reply, Request, Status};
use crate::receiver::Receiver;

/// A line that carries bytes both ways.
pub trait Port {
    /// Sends all of them.
    ///
    /// # Errors
    /// What the system says.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits for bytes, at most `limit`; returns how many are in `buffer`, 0 on a timeout.
    ///
    /// # Errors
    /// The error of the operating system; `UnexpectedEof` if the other side is gone.
    fn receive(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize>;
}

impl<P: Port + ?Sized> Port for std::boxed::Box<P> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        (**self).receive(buffer, limit)
    }
}

/// How long a client waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeout {
    /// For an answer.
    pub limit: Duration,
    /// Most attempts per request.
    pub attempts: u32,
}

impl Timeout {
    /// For a serial line: an answer comes within milliseconds, and noise may destroy a frame. A short request is
    /// repeated after a quarter of the limit, so that a machine whose host asks every 20 ms gets it before it takes the
    /// host for lost (`supervisor.host_lost`, 100 ms).
    pub const SERIAL: Self = Self { limit: Duration::from_millis(250), attempts: 8 };
    /// For a socket of this computer: it loses nothing, and a closed connection is noticed. The server may be slow, as
    /// an emulated board on a loaded computer is. An early repetition would only queue up.
    pub const SOCKET: Self = Self { limit: Duration::from_secs(1), attempts: 60 };
    /// For a pipe, which loses nothing: an answer comes, or the other side hangs.
    pub const PIPE: Self = Self { limit: Duration::from_secs(10), attempts: 1 };
}

impl Timeout {
    /// Requests with pieces or long computations get their whole limit: an early repetition would only delay them.
    fn of(self, request: &Request<'_>) -> Self {
        let short = matches!(
            request,
            Request::Status
                | Request::Health
                | Request::Place
                | Request::Supervise { .. }
                | Request::Setpoint { .. }
                | Request::Wave { .. }
                | Request::Pass { .. }
                | Request::Stream { .. }
                | Request::Samples
        );
        if !short || self.attempts == 1 {
            return self;
        }
        Self { limit: self.limit / 4, attempts: self.attempts.saturating_mul(4) }
    }
}

/// Reason why there is no answer.
#[derive(Debug)]
pub enum ClientError {
    /// No complete answer arrived.
    Silent {
        /// How long in all.
        waited: Duration,
        /// Number of attempts.
        attempts: u32,
        /// Damaged frames in the meantime.
        damaged: u32,
    },
    /// The line broke.
    Port(io::Error),
    /// The device speaks another version of the protocol.
    Version {
        /// Its version.
        found: u8,
    },
    /// The device refuses the request.
    Refused(Refusal),
    /// An answer to another request.
    Unexpected,
    /// The request is longer than the longest message.
    TooLong,
}

impl fmt::Display for ClientError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silent { waited, attempts, damaged } => {
                write!(f, "no answer within {:.1} s ({attempts} attempts)", waited.as_secs_f64())?;
                if *damaged > 0 {
                    write!(f, "; {damaged} frames were damaged: check baud rate, cable and ground")?;
                }
                Ok(())
            }
            Self::Port(error) => error.fmt(f),
            Self::Version { found } => write!(
                f,
                "the device speaks version {found} of the link, expected {VERSION}: build and flash it with this specgen"
            ),
            Self::Refused(refusal) => write!(f, "the device refuses: {}", words(*refusal)),
            Self::Unexpected => {
                f.write_str("the device sent an unexpected answer: build and flash it with this specgen")
            }
            Self::TooLong => f.write_str("the request is longer than the longest message of the link"),
        }
    }
}

impl std::error::Error for ClientError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Port(error) => Some(error),
            _ => None,
        }
    }
}

fn words(refusal: Refusal) -> String {
    use std::format;
    match refusal {
        Refusal::Unsupported => {
            "it does not do that; flash an image that does (for lock-step: `specgen flash --lockstep`)".into()
        }
        Refusal::NoSession => "no session is open; it restarted, or another host opened one".into(),
        Refusal::Sequence => "requests arrived out of order; is another host connected?".into(),
        Refusal::Version => "another version of the link".into(),
        Refusal::Message => "it cannot read the message; flash an image of this specgen".into(),
        Refusal::Length { expected } => format!("expected {expected} words; is it the controller of this spec?"),
        Refusal::Word { index } => format!("word {index} is out of its range"),
        Refusal::State => "not in its present state".into(),
        Refusal::TooLong => "its answer does not fit into a message".into(),
        Refusal::Busy => "another host is in control; hold, ramp-down and stop are accepted from every host, other requests once that host has ended its session".into(),
        Refusal::Rate { least } => format!("its line cannot carry that many samples; use rows of at least {least} ticks"),
    }
}

/// Sends requests to a device, one at a time.
pub struct Client<P> {
    port: P,
    timeout: Timeout,
    receiver: Receiver,
    session: u16,
    sequence: u16,
    request: Frame,
    answer: Vec<u8>,
    damaged: u32,
    telemetry: Option<Status>,
}

impl<P: Port> Client<P> {
    /// Opens a session and returns the device's identity; `session` should differ from the last one.
    ///
    /// # Errors
    /// As [`Client::ask`].
    pub fn open(port: P, session: u16, timeout: Timeout) -> Result<(Self, Identity), ClientError> {
        let mut client = Self {
            port,
            timeout,
            receiver: Receiver::new(),
            session,
            sequence: 0,
            request: Frame::EMPTY,
            answer: Vec::new(),
            damaged: 0,
            telemetry: None,
        };
        // Ends any garbage on the line.
        client.port.send(&[0]).map_err(ClientError::Port)?;
        let identity = match client.hello() {
            // By chance, the device's last session had the same number.
            Err(ClientError::Refused(Refusal::Sequence)) => {
                client.session = client.session.wrapping_add(1);
                client.hello()?
            }
            other => other?,
        };
        Ok((client, identity))
    }

    fn hello(&mut self) -> Result<Identity, ClientError> {
        match self.ask(&Request::Hello)? {
            Reply::Identity(identity) => Ok(identity),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Sends a request, repeatedly if needed, and waits for its answer.
    ///
    /// # Errors
    /// If there is no answer, the line is broken, the version differs, or the device refuses.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Reply<'_>, ClientError> {
        let header = Header { version: VERSION, kind: Kind::Request, session: self.session, sequence: self.sequence };
        if !self.request.set(&header, request) {
            return Err(ClientError::TooLong);
        }
        let Timeout { limit, attempts } = self.timeout.of(request);
        let start = Instant::now();
        let before = self.damaged;
        let mut came = false;
        for _ in 0..attempts {
            self.port.send(self.request.bytes()).map_err(ClientError::Port)?;
            if self.wait(&header, limit)? {
                came = true;
                break;
            }
        }
        if !came {
            return Err(ClientError::Silent { waited: start.elapsed(), attempts, damaged: self.damaged - before });
        }
        match frame::message::<Reply<'_>>(&self.answer).ok_or(ClientError::Unexpected)? {
            // Not carried out, so the number was not used.
            Reply::Refused(
                refusal @ (Refusal::NoSession | Refusal::Sequence | Refusal::Version | Refusal::Message),
            ) => Err(ClientError::Refused(refusal)),
            Reply::Refused(refusal) => {
                self.sequence = self.sequence.wrapping_add(1);
                Err(ClientError::Refused(refusal))
            }
            reply => {
                self.sequence = self.sequence.wrapping_add(1);
                Ok(reply)
            }
        }
    }

    /// Stores the message of the answer to a request; false if it does not come in time.
    fn wait(&mut self, asked: &Header, limit: Duration) -> Result<bool, ClientError> {
        let start = Instant::now();
        let mut buffer = [0; 4096];
        loop {
            let left = limit.saturating_sub(start.elapsed());
            let count = self.port.receive(&mut buffer, left).map_err(ClientError::Port)?;
            // Bytes after an answer belong to no open request.
            for byte in &buffer[..count] {
                match self.receiver.push(*byte) {
                    None => {}
                    Some(Err(_)) => self.damaged = self.damaged.saturating_add(1),
                    Some(Ok((header, _))) if header.version != VERSION => {
                        return Err(ClientError::Version { found: header.version });
                    }
                    Some(Ok((header, message))) if header.kind == Kind::Telemetry => {
                        self.telemetry = frame::message(message).or(self.telemetry);
                    }
                    Some(Ok((header, message))) if header == (Header { kind: Kind::Reply, ..*asked }) => {
                        self.answer.clear();
                        self.answer.extend_from_slice(message);
                        return Ok(true);
                    }
                    // A late answer to an earlier request.
                    Some(Ok(_)) => {}
                }
            }
            if left.is_zero() {
                return Ok(false);
            }
        }
    }

    /// Fetches the whole of something in pieces: `request` makes the request for the piece at an offset.
    ///
    /// # Errors
    /// As [`Client::ask`], or if the pieces do not make a whole.
    pub fn fetch(&mut self, request: impl Fn(u32) -> Request<'static>) -> Result<Vec<u8>, ClientError> {
        let mut whole = Vec::new();
        while !self.fetch_on(&request, &mut whole)? {}
        Ok(whole)
    }

    /// Fetches the next piece and appends it; returns whether it is complete.
    ///
    /// # Errors
    /// As [`Client::ask`]; a device that does not go on where it was is [`ClientError::Unexpected`].
    pub fn fetch_on(
        &mut self,
        request: impl Fn(u32) -> Request<'static>,
        whole: &mut Vec<u8>,
    ) -> Result<bool, ClientError> {
        let wanted = u32::try_from(whole.len()).map_err(|_| ClientError::TooLong)?;
        let Reply::Chunk { offset, total, bytes } = self.ask(&request(wanted))? else {
            return Err(ClientError::Unexpected);
        };
        whole.extend_from_slice(bytes.0);
        let complete = whole.len() == total as usize;
        if offset != wanted || whole.len() > total as usize || (bytes.0.is_empty() && !complete) {
            return Err(ClientError::Unexpected);
        }
        Ok(complete)
    }

    /// The last telemetry of the device.
    #[must_use]
    pub fn telemetry(&self) -> Option<&Status> {
        self.telemetry.as_ref()
    }

    /// Damaged frames from the device.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Waits differently from here on.
    pub fn set_timeout(&mut self, timeout: Timeout) {
        self.timeout = timeout;
    }

    /// The line.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_short_is_sent_again_sooner_but_given_up_no_earlier() {
        let Timeout { limit, attempts } = Timeout::SERIAL;
        let short = Timeout::SERIAL.of(&Request::Status);
        assert_eq!((short.limit * 4, short.attempts), (limit, attempts * 4));
        assert!(
            short.limit < Duration::from_millis(80),
            "with 20 ms between requests a host is not lost for one that is"
        );
        assert_eq!(Timeout::SERIAL.of(&Request::Download { offset: 0 }), Timeout::SERIAL);
        assert_eq!(Timeout::PIPE.of(&Request::Status), Timeout::PIPE);
    }
}
