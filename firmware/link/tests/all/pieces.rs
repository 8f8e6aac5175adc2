//! What the link is made of, piece by piece: bytes, sizes, names, a client against a device of a test, a lock-step.

use std::error::Error;
use std::io;
use std::time::Duration;

use specgen_link::client::{Client, ClientError, Port, Timeout};
use specgen_link::lockstep::{Lockstep, Machine};
use specgen_link::{
    Bytes, CostUnit, Device, Endpoint, FRAME, Header, KNOT, Kind, MESSAGE, Receiver, Refusal, Reply, Request, Stage,
    VERSION, WORDS, put_knots, reset_cause,
};

use crate::support::{IDENTITY, Notebook, Tap, answered, words};

#[test]
fn sizes_are_those_of_the_protocol() {
    assert_eq!((FRAME, MESSAGE, KNOT, WORDS), (1024, 1008, 24, 120));
}

#[test]
fn knots_are_read_as_they_were_put_from_any_byte_on() {
    let knots: Vec<[i32; 6]> = (0..5).map(|k| core::array::from_fn(|axis| (k - 2) * (1 << 20) + axis as i32)).collect();
    let whole: Vec<u8> = knots.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
    assert_eq!(Bytes(&whole).knots().unwrap().collect::<Vec<_>>(), knots);
    assert!(Bytes(&whole[..whole.len() - 1]).knots().is_none());
    for size in [0, 1, 7, KNOT, 2 * KNOT + 3, whole.len(), whole.len() + 5] {
        let mut buffer = vec![0xaa; size];
        for offset in 0..whole.len() + 3 {
            let left = whole.get(offset..).unwrap_or_default();
            let most = left.len().min(size);
            assert_eq!(put_knots(&knots, offset, &mut buffer), &left[..most], "{size} bytes from {offset} on");
        }
    }
}

#[test]
fn words_are_read_only_if_there_are_as_many() {
    let bytes = words(3, 9);
    let mut read = [7; 3];
    for length in 0..bytes.len() {
        assert!(!Bytes(&bytes[..length]).read_words(&mut read), "{length}");
    }
    assert_eq!(read, [7; 3]);
    assert!(Bytes(&bytes).read_words(&mut read));
    assert_eq!(read.map(u64::to_le_bytes).as_flattened(), bytes);
    assert!(!Bytes(&bytes).read_words(&mut [0; 2]) && !Bytes(&bytes).read_words(&mut [0; 4]));
}

#[test]
fn the_cause_of_a_reset_has_its_bits_and_names() {
    for bit in 0..8 {
        let flags = core::array::from_fn(|other| other == bit);
        assert_eq!(reset_cause::of(flags), 1 << bit);
        assert_eq!(reset_cause::names(1 << bit).collect::<Vec<_>>(), [reset_cause::NAMES[bit]]);
    }
    let flags = [true, false, true, true, false, false, false, true];
    assert_eq!(reset_cause::of(flags), 0b1000_1101);
    let names = ["power-up", "reset pin", "software", "no external clock"];
    assert_eq!(reset_cause::names(0b1000_1101).collect::<Vec<_>>(), names);
    assert_eq!(reset_cause::names(0).count(), 0);
}

/// A frame of a kind and version, as the device sends it to a request.
fn frame(asked: &[u8], device: &mut dyn Device, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let out = answered(&mut Endpoint::new(), device, asked);
    if out.is_empty() {
        return out;
    }
    let mut body = unstuffed(&out);
    body.truncate(body.len() - 4);
    change(&mut body);
    let sum = crc32c(&body);
    body.extend(sum.to_le_bytes());
    stuffed(&body)
}

/// CRC-32C, bit by bit.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ if sum & 1 == 1 { 0x82f6_3b78 } else { 0 })
    })
}

/// COBS, without its zero.
fn unstuffed(frame: &[u8]) -> Vec<u8> {
    let (mut body, mut at) = (Vec::new(), 0);
    while frame[at] != 0 {
        let length = usize::from(frame[at]);
        body.extend_from_slice(&frame[at + 1..at + length]);
        at += length;
        if length < 255 && frame[at] != 0 {
            body.push(0);
        }
    }
    body
}

/// COBS of a short body, with its zero.
fn stuffed(body: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    for run in body.split(|byte| *byte == 0) {
        assert!(run.len() < 254, "a short body");
        frame.push(run.len() as u8 + 1);
        frame.extend_from_slice(run);
    }
    frame.push(0);
    frame
}

fn opened(change: &dyn Fn(&mut Vec<u8>), attempts: u32) -> Result<(), ClientError> {
    let (mut sent, mut device) = (Vec::new(), Notebook::default());
    let mut answer = |bytes: &[u8]| frame(bytes, &mut device, change);
    let timeout = Timeout { limit: Duration::ZERO, attempts };
    Client::open(Tap(&mut sent, &mut answer, Vec::new()), 5, timeout)
        .map(|(_, identity)| assert_eq!(identity, IDENTITY))
}

/// Only the reply of the same session and number is one; another version is named.
#[test]
fn a_client_takes_the_answer_to_its_request_and_no_other() {
    opened(&|_| {}, 1).unwrap();
    for (place, byte) in [(1, 0), (1, 9), (2, 6), (3, 1), (4, 1), (5, 1)] {
        let refused = opened(&|body| body[place] = byte, 2);
        assert!(matches!(refused, Err(ClientError::Silent { attempts: 2, damaged: 0, .. })), "{place}: {refused:?}");
    }
    let other = opened(&|body| body[0] = VERSION + 1, 2);
    assert!(matches!(other, Err(ClientError::Version { found }) if found == VERSION + 1), "{other:?}");
    let damaged = opened(&|body| body.truncate(3), 2);
    assert!(matches!(damaged, Err(ClientError::Silent { attempts: 2, damaged: 2, .. })), "{damaged:?}");
    let nonsense = opened(&|body| body.truncate(6), 2);
    assert!(matches!(nonsense, Err(ClientError::Unexpected)), "{nonsense:?}");
}

/// Hands out a text in pieces, as it is told.
struct Pieces {
    pieces: Vec<(u32, u32, &'static [u8])>,
}

impl Device for Pieces {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        match request {
            Request::Hello => Reply::Identity(IDENTITY),
            Request::Describe { .. } if !self.pieces.is_empty() => {
                let (offset, total, bytes) = self.pieces.remove(0);
                Reply::Chunk { offset, total, bytes: Bytes(bytes) }
            }
            _ => Reply::Done,
        }
    }
}

fn fetched(pieces: &[(u32, u32, &'static [u8])]) -> Result<Vec<u8>, ClientError> {
    let (mut sent, mut endpoint) = (Vec::new(), Endpoint::new());
    let mut device = Pieces { pieces: pieces.to_vec() };
    let mut answer = |bytes: &[u8]| answered(&mut endpoint, &mut device, bytes);
    let port: Box<dyn Port> = Box::new(Tap(&mut sent, &mut answer, Vec::new()));
    let (mut client, _) = Client::open(port, 1, Timeout::PIPE).unwrap();
    client.fetch(|offset| Request::Describe { offset })
}

#[test]
fn pieces_make_a_whole_or_nothing() {
    assert_eq!(fetched(&[(0, 5, b"abc"), (3, 5, b"de")]).unwrap(), b"abcde");
    assert_eq!(fetched(&[(0, 3, b"abc")]).unwrap(), b"abc");
    assert_eq!(fetched(&[(0, 0, b"")]).unwrap(), b"");
    // Elsewhere than asked for, more than there is, nothing more, no piece.
    for pieces in [
        &[(0, 5, &b"abc"[..]), (2, 5, b"de")][..],
        &[(1, 3, b"abc")],
        &[(0, 5, b"abc"), (3, 5, b"def")],
        &[(0, 2, b"abc"), (3, 3, b"")],
        &[(0, 5, b"abc"), (3, 5, b"")],
        &[],
    ] {
        let refused = fetched(pieces);
        assert!(matches!(refused, Err(ClientError::Unexpected)), "{pieces:?}: {refused:?}");
    }
}

/// Gives no answer and notes how long it was waited for.
struct Silent(Vec<Duration>, u32);

impl Port for Silent {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        self.1 += 1;
        Ok(())
    }

    fn receive(&mut self, _: &mut [u8], limit: Duration) -> io::Result<usize> {
        self.0.push(limit);
        if limit > Duration::from_secs(1) { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(0) }
    }
}

#[test]
fn a_client_waits_as_it_is_told_and_a_broken_line_ends_it() {
    let (mut sent, mut endpoint, mut device) = (Vec::new(), Endpoint::new(), Notebook::default());
    let mut on = true;
    let mut answer = |bytes: &[u8]| {
        let all = answered(&mut endpoint, &mut device, bytes);
        if std::mem::replace(&mut on, bytes.len() < 3) { all } else { Vec::new() }
    };
    let port = Tap(&mut sent, &mut answer, Vec::new());
    let (mut client, _) = Client::open(port, 1, Timeout { limit: Duration::ZERO, attempts: 2 }).unwrap();
    client.set_timeout(Timeout { limit: Duration::ZERO, attempts: 5 });
    let silent = client.ask(&Request::ReadConfig);
    assert!(matches!(silent, Err(ClientError::Silent { attempts: 5, .. })), "{silent:?}");
    let before = client.port().0.len();
    assert!(
        client
            .ask(&Request::Setpoint { words: Bytes(&[0; MESSAGE]) })
            .is_err_and(|error| matches!(error, ClientError::TooLong))
    );
    assert_eq!(client.port().0.len(), before);

    let mut broken: Box<dyn Port> = Box::new(Silent(Vec::new(), 0));
    assert!(broken.send(&[1]).is_ok());
    assert!(broken.receive(&mut [0], Duration::from_secs(2)).is_err());
    let Err(ended) = Client::open(Silent(Vec::new(), 0), 1, Timeout::PIPE) else { panic!("it opened") };
    assert!(matches!(&ended, ClientError::Port(error) if error.kind() == io::ErrorKind::UnexpectedEof));
    assert!(ended.source().is_some() && ended.to_string() == io::Error::from(io::ErrorKind::UnexpectedEof).to_string());
}

#[test]
fn every_error_says_what_it_is() {
    let waited = Duration::from_millis(1500);
    let silent = |damaged| ClientError::Silent { waited, attempts: 3, damaged };
    assert_eq!(silent(0).to_string(), "no answer within 1.5 s (3 attempts)");
    assert!(silent(1).to_string().starts_with("no answer within 1.5 s (3 attempts); 1 frames were damaged"));
    assert!(silent(0).source().is_none());
    let said = |refusal| ClientError::Refused(refusal).to_string();
    let all = [
        (Refusal::Unsupported, "does not do that"),
        (Refusal::NoSession, "no session is open"),
        (Refusal::Sequence, "out of order"),
        (Refusal::Version, "another version"),
        (Refusal::Message, "cannot read"),
        (Refusal::Length { expected: 35 }, "35 words"),
        (Refusal::Word { index: 4 }, "word 4 "),
        (Refusal::State, "present state"),
        (Refusal::TooLong, "does not fit"),
        (Refusal::Busy, "another host"),
        (Refusal::Rate { least: 12 }, "12 ticks"),
    ];
    for (refusal, text) in all {
        assert!(said(refusal).starts_with("the device refuses: ") && said(refusal).contains(text), "{refusal:?}");
    }
    assert!(ClientError::Version { found: 9 }.to_string().contains("version 9"));
    assert!(ClientError::TooLong.to_string().contains("longer"));
    assert!(ClientError::Unexpected.to_string().contains("unexpected answer"));
}

/// Two settings, one input, two outputs.
#[derive(Default)]
struct Adder {
    settings: [u64; 2],
    total: u64,
    resets: u32,
}

impl Machine for Adder {
    fn description(&self) -> &str {
        "name=adder\n"
    }

    fn words(&self) -> [usize; 3] {
        [2, 1, 2]
    }

    fn stages(&self) -> usize {
        2
    }

    fn counted(&self) -> CostUnit {
        CostUnit::Instructions
    }

    fn configure(&mut self, config: &[u64]) -> Result<(), usize> {
        if config[1] > 9 {
            return Err(1);
        }
        self.settings.copy_from_slice(config);
        Ok(())
    }

    fn reset(&mut self) {
        (self.total, self.resets) = (0, self.resets + 1);
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32) {
        self.total += input[0] + self.settings[0];
        output.copy_from_slice(&[self.total, input[0]]);
        (self.total + 1, 3)
    }

    fn stage(&self, index: usize) -> Option<Stage<'_>> {
        (index < 2).then_some(Stage { name: "x", calls: 1, smallest: 2, sum: 3, largest: 4, stack: None })
    }
}

fn two(words: [u64; 2]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

#[test]
fn a_lock_step_steps_from_a_reset_on_and_refuses_what_does_not_fit() {
    let mut device = Lockstep::new(Adder::default());
    let (good, bad) = (two([5, 1]), two([5, 10]));
    let one = 7_u64.to_le_bytes();
    let step = Request::LockstepStep { input: Bytes(&one) };
    assert_eq!(device.execute(&step), Reply::Refused(Refusal::State));
    assert_eq!(device.execute(&Request::WriteConfig { words: Bytes(&good) }), Reply::Done);
    assert_eq!(device.execute(&step), Reply::Refused(Refusal::State), "settings are no reset");
    let reset = |config| Request::LockstepReset { config: Bytes(config) };
    assert_eq!(device.execute(&reset(&bad)), Reply::Refused(Refusal::Word { index: 1 }));
    assert_eq!(device.execute(&reset(&good[..8])), Reply::Refused(Refusal::Length { expected: 2 }));
    assert_eq!(device.execute(&step), Reply::Refused(Refusal::State));
    assert_eq!(device.machine().resets, 0);
    assert_eq!(device.execute(&reset(&good)), Reply::Done);
    assert_eq!(device.machine().resets, 1);
    for total in [12, 24] {
        let output = two([total, 7]);
        let expected = Reply::Stepped { cost: 3, digest: total + 1, output: Bytes(&output) };
        assert_eq!(device.execute(&step), expected);
    }
    let long = Request::LockstepStep { input: Bytes(&good) };
    assert_eq!(device.execute(&long), Reply::Refused(Refusal::Length { expected: 1 }));
    device.machine_mut().total = 100;
    assert!(matches!(device.execute(&step), Reply::Stepped { digest: 113, .. }));
    let Reply::Identity(identity) = device.execute(&Request::Hello) else { panic!("no identity") };
    assert_eq!([identity.config_words, identity.input_words, identity.output_words], [2, 1, 2]);
    assert_eq!((identity.stages, identity.counted, identity.description), (2, CostUnit::Instructions, 11));
    let piece = Reply::Chunk { offset: 5, total: 11, bytes: Bytes(b"adder\n") };
    assert_eq!(device.execute(&Request::Describe { offset: 5 }), piece);
    assert!(matches!(device.execute(&Request::LockstepStage { index: 1 }), Reply::Stage(_)));
    assert_eq!(device.execute(&Request::LockstepStage { index: 2 }), Reply::Refused(Refusal::Unsupported));
    assert_eq!(device.execute(&Request::Status), Reply::Refused(Refusal::Unsupported));
}

#[test]
fn what_is_damaged_is_counted_by_kind_and_summed() {
    let (mut endpoint, mut device) = (Endpoint::new(), Notebook::default());
    let mut feed = |bytes: &[u8]| {
        for byte in bytes {
            assert_eq!(endpoint.push(*byte, &mut device), None);
        }
    };
    feed(&[1; FRAME + 9]);
    feed(&[0, 3, 1, 0]);
    feed(&stuffed(&[VERSION, 0, 1, 1, 1, 1, 1, 2, 3, 4, 5]));
    let mut other = vec![VERSION, 2, 1, 1, 1, 1, 1];
    other.extend(crc32c(&other).to_le_bytes());
    feed(&stuffed(&other));
    let counters = endpoint.counters();
    let counted = [counters.overlong, counters.malformed, counters.checksum, counters.kind];
    assert_eq!((counted, counters.errors()), ([1, 1, 1, 1], 4), "{counters:?}");
    let mut receiver = Receiver::new();
    let seen =
        stuffed(&other).into_iter().find_map(|byte| receiver.push(byte).map(|found| found.map(|(header, _)| header)));
    let header = Header { version: VERSION, kind: Kind::Telemetry, session: 0x101, sequence: 0x101 };
    assert_eq!(seen, Some(Ok(header)));
}
