//! A host on the link, and its records.

use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

use host_sim::controller::Supervised;
use host_sim::record::{FileItem, Reader, Replay, Row, replay};
use specgen_link::client::{Client, ClientError, Port, Timeout};
use specgen_link::{Identity, RecorderAction, RecorderStatus, Refusal, Reply, Request, Status};
use specgen_runtime::record::checksum;

/// The frames of the link on a Unix socket.
pub struct Socket(pub UnixStream);

impl Port for Socket {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        self.0.set_read_timeout(Some(limit.max(Duration::from_millis(1))))?;
        match self.0.read(buffer) {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(0),
            other => other,
        }
    }
}

/// A session.
pub struct Host {
    client: Client<Socket>,
    pub identity: Identity,
}

impl Host {
    pub fn open(path: &Path, session: u16) -> Result<Self, ClientError> {
        let port = Socket(UnixStream::connect(path).map_err(ClientError::Port)?);
        let (client, identity) = Client::open(port, session, Timeout::PIPE)?;
        Ok(Self { client, identity })
    }

    pub fn done(&mut self, request: &Request<'_>) {
        match self.client.ask(request) {
            Ok(Reply::Done) => {}
            other => panic!("{request:?}: {other:?}"),
        }
    }

    pub fn refused(&mut self, request: &Request<'_>) -> Refusal {
        match self.client.ask(request) {
            Err(ClientError::Refused(refusal)) => refusal,
            other => panic!("{request:?}: {other:?}"),
        }
    }

    pub fn status(&mut self) -> Status {
        match self.client.ask(&Request::Status) {
            Ok(Reply::Status(status)) => status,
            other => panic!("{other:?}"),
        }
    }

    /// Whether a request to the supervisor is accepted: a host that is not in control is refused.
    pub fn asks(&mut self, request: u8) -> bool {
        matches!(self.client.ask(&Request::Supervise { request }), Ok(Reply::Done))
    }

    /// Whether it still gets answers.
    pub fn is_answered(&mut self) -> bool {
        self.client.ask(&Request::Status).is_ok()
    }

    /// Polls the status, which keeps the link alive, until a condition holds.
    pub fn wait(&mut self, what: &str, wanted: impl Fn(&Status) -> bool) -> Status {
        let start = Instant::now();
        loop {
            let status = self.status();
            if wanted(&status) {
                return status;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "{what}: {status:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub fn recorder(&mut self, action: RecorderAction) -> RecorderStatus {
        match self.client.ask(&Request::Recorder { action }) {
            Ok(Reply::Recorder(status)) => status,
            other => panic!("{other:?}"),
        }
    }

    pub fn config(&mut self) -> Vec<u64> {
        let count = usize::from(self.identity.config_words);
        match self.client.ask(&Request::ReadConfig) {
            Ok(Reply::Config { words }) => words.words(count).unwrap().collect(),
            other => panic!("{other:?}"),
        }
    }

    pub fn fetch(&mut self, request: impl Fn(u32) -> Request<'static>) -> Vec<u8> {
        self.client.fetch(request).unwrap()
    }

    /// The raw line.
    pub fn line(&mut self) -> &mut UnixStream {
        &mut self.client.port().0
    }
}

/// A record.
pub struct Record {
    pub bytes: Vec<u8>,
    pub names: Vec<String>,
    pub rows: Vec<Row>,
}

impl Record {
    pub fn new(bytes: Vec<u8>) -> Self {
        let mut reader = Reader::new(&bytes[..]).unwrap();
        let (names, mut rows) = (reader.input_names(), Vec::new());
        while let Some(piece) = reader.next_piece().unwrap() {
            match piece {
                FileItem::Block(block) => rows.extend(block.rows),
                other => panic!("{other:?}"),
            }
        }
        Self { bytes, names, rows }
    }

    pub fn place(&self, name: &str) -> usize {
        self.names.iter().position(|known| known == name).unwrap()
    }

    /// Replays the record.
    pub fn replay(&self, machine: &mut Supervised) -> Replay {
        let mut reader = Reader::new(&self.bytes[..]).unwrap();
        replay(&mut reader, machine, |_, _, _| ()).unwrap_or_else(|error| panic!("{error}"))
    }

    /// A copy with one flipped bit in the first code of the last tick, and a correct checksum.
    pub fn flipped(&self) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let mut at = 16 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize + 8;
        let (mut start, mut count) = (at, 0);
        while at < bytes.len() {
            (start, count) = (at, word(at + 8) as usize);
            at += (count + 1) * 8;
        }
        // The row ends with three words of codes, one of status and supervisor, and the digest.
        bytes[start + (count - 5) * 8] ^= 1;
        let block = &bytes[start..start + count * 8];
        let words: Vec<u64> = block.as_chunks().0.iter().map(|chunk| u64::from_le_bytes(*chunk)).collect();
        bytes[start + count * 8..].copy_from_slice(&checksum(&words).to_le_bytes());
        bytes
    }
}
