//! Sessions with frames truncated, repeated, lost or flipped at every byte: what is carried out is what was asked, in its
//! order, each once; the rest is counted.

use crate::support;
use crate::support::{Notebook, answered, leaked, session};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_link::client::{Client, Port, Timeout};
use specgen_link::{Counters, Device, Endpoint, FRAME, Reply, Request};
use std::io;
use std::time::Duration;

fn requests() -> Vec<Request<'static>> {
    vec![
        Request::Supervise { request: 1 },
        Request::WriteConfig { words: leaked(30, 2) },
        Request::Setpoint { words: leaked(6, 1) },
        Request::Status,
        Request::Supervise { request: 2 },
    ]
}

/// What a fresh device makes of the bytes.
fn feed(bytes: &[u8]) -> (Vec<String>, Counters) {
    let (mut endpoint, mut device) = (Endpoint::new(), Notebook::default());
    answered(&mut endpoint, &mut device, bytes);
    (device.carried_out, *endpoint.counters())
}

/// Damaged bytes, followed by the whole session sent again frame by frame as a client does: nothing is carried out that
/// was not asked, nothing twice, nothing out of order, and in the end all of it.
fn check(damaged: &[u8], whole: &[Vec<u8>], expected: &[String], what: &str) {
    let (carried_out, counters) = feed(damaged);
    assert!(expected.starts_with(&carried_out), "{what}: {carried_out:?}");
    if carried_out.len() < expected.len() {
        // What was cut off at the end was never seen; without its zero a frame has not ended yet.
        let unseen = damaged.len() < whole.concat().len() || damaged.last() != Some(&0);
        assert!(counters.errors() > 0 || unseen, "{what}: lost and not counted");
    }
    // The client resends what was not answered; a zero ends what is left of a damaged frame.
    let again: Vec<u8> = [0].into_iter().chain(whole[1 + carried_out.len()..].concat()).collect();
    let (all, _) = feed(&[damaged, &again].concat());
    assert_eq!(all, expected, "{what}: not recovered");
}

#[test]
fn every_flipped_bit_is_counted_and_nothing_wrong_is_carried_out() {
    let whole = session(&requests());
    let bytes = whole.concat();
    let (expected, _) = feed(&bytes);
    assert_eq!(expected.len(), 6);
    for place in 1..bytes.len() {
        for bit in 0..8 {
            let mut damaged = bytes.clone();
            damaged[place] ^= 1 << bit;
            let (carried_out, counters) = feed(&damaged);
            // Without its last zero a frame has not ended yet.
            let open = place == bytes.len() - 1;
            assert!(carried_out.len() < 6 && (counters.errors() > 0 || open), "byte {place} bit {bit}");
            check(&damaged, &whole, &expected, &format!("byte {place} bit {bit}"));
        }
    }
}

#[test]
fn every_byte_lost_doubled_or_replaced_and_every_truncation() {
    let whole = session(&requests());
    let bytes = whole.concat();
    let (expected, _) = feed(&bytes);
    assert_eq!(expected.len() + 1, whole.len(), "all but the greeting are carried out");
    for place in 1..bytes.len() {
        let (before, after) = bytes.split_at(place);
        check(&[before, &after[1..]].concat(), &whole, &expected, &format!("byte {place} lost"));
        check(&[before, &after[..1], after].concat(), &whole, &expected, &format!("byte {place} doubled"));
        check(&[before, &[0], &after[1..]].concat(), &whole, &expected, &format!("byte {place} zero"));
        check(before, &whole, &expected, &format!("truncated at byte {place}"));
        // The rest of the frame is lost, the next one comes whole.
        let next = after.iter().position(|byte| *byte == 0).unwrap();
        check(&[before, &after[next..]].concat(), &whole, &expected, &format!("frame truncated at byte {place}"));
        check(&[before, &after[next + 1..]].concat(), &whole, &expected, &format!("end lost from byte {place}"));
    }
}

#[test]
fn repeated_frames_are_answered_and_not_carried_out_again() {
    let whole = session(&requests());
    let (expected, _) = feed(&whole.concat());
    let (mut endpoint, mut device) = (Endpoint::new(), Notebook::default());
    for frame in &whole[1..] {
        let mut answers = Vec::new();
        for _ in 0..3 {
            for byte in frame {
                answers.extend(endpoint.push(*byte, &mut device).map(<[u8]>::to_vec));
            }
        }
        assert!(answers.len() == 3 && answers[0] == answers[1] && answers[1] == answers[2]);
    }
    assert_eq!(device.carried_out, expected);
    let counters = endpoint.counters();
    assert_eq!((counters.executed, counters.repeated, counters.errors()), (6, 12, 0));

    // An older one, late: refused, and the last answer is kept for a repetition of its request.
    answered(&mut endpoint, &mut device, &whole[3]);
    let last: Vec<Vec<u8>> =
        whole[6].iter().filter_map(|byte| endpoint.push(*byte, &mut device).map(<[u8]>::to_vec)).collect();
    assert_eq!((device.carried_out.len(), endpoint.counters().sequence, last.len()), (6, 1, 1));
    assert!(endpoint.counters().repeated == 13);
}

#[test]
fn no_two_flipped_bits_of_a_frame_pass() {
    let whole = session(&requests()[..1]);
    let hello = [&whole[0][..], &whole[1]].concat();
    let frame = &whole[2];
    let bits = frame.len() * 8;
    for first in 0..bits {
        for second in first + 1..bits {
            let mut damaged = frame.clone();
            for bit in [first, second] {
                damaged[bit / 8] ^= 1 << (bit % 8);
            }
            let (carried_out, _) = feed(&[&hello[..], &damaged, &[0]].concat());
            assert_eq!(carried_out.len(), 1, "bits {first} and {second}");
        }
    }
}

#[test]
fn a_million_random_streams_are_counted_and_nothing_is_carried_out() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let (mut endpoint, mut device) = (Endpoint::new(), Notebook::default());
    let whole = session(&requests());
    let mut frames = 0_u64;
    for stream in 0..1_000_000_u32 {
        let length = random.next_u32() as usize % 48;
        let mut bytes = [0; 48];
        random.fill_bytes(&mut bytes);
        if stream % 4 == 0 {
            // A good frame with a piece of it replaced.
            let frame = &whole[1 + stream as usize / 4 % 6];
            let from = random.next_u32() as usize % frame.len().min(40);
            let part = &frame[from..frame.len().min(from + 48)];
            bytes[..part.len()].copy_from_slice(part);
            bytes[random.next_u32() as usize % part.len()] ^= 1 << (random.next_u32() % 8);
        }
        for byte in &bytes[..length] {
            frames += u64::from(*byte == 0);
            endpoint.push(*byte, &mut device);
        }
    }
    assert_eq!(device.carried_out, Vec::<String>::new());
    let counters = *endpoint.counters();
    assert!(counters.malformed > 10_000 && counters.checksum > 1_000 && frames > 100_000, "{counters:?}");

    // Longer than any frame, then a session: one frame is lost, the session is not.
    answered(&mut endpoint, &mut device, &[0x55; 3 * FRAME]);
    answered(&mut endpoint, &mut device, &whole.concat());
    assert_eq!(device.carried_out, feed(&whole.concat()).0);
    assert_eq!(endpoint.counters().overlong, counters.overlong + 1);
}

#[test]
fn another_version_is_named_and_a_reply_is_no_request() {
    let whole = session(&requests());
    let (mut endpoint, mut device) = (Endpoint::new(), Notebook::default());
    for byte in answered(&mut endpoint, &mut device, &whole[1]) {
        assert_eq!(endpoint.push(byte, &mut device), None);
    }
    assert_eq!((endpoint.counters().kind, device.carried_out.len()), (1, 1));
}

/// A line that flips, loses and doubles bytes, with the device at its end.
struct Noisy {
    random: ChaCha8Rng,
    endpoint: Endpoint,
    device: Sum,
    coming: Vec<u8>,
    /// One byte in so many is hit.
    rate: u32,
}

/// Adds up the words of its set-points: an addition left out, or made twice, shows.
#[derive(Default)]
struct Sum {
    total: u64,
}

impl Device for Sum {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        match request {
            Request::Hello => Reply::Identity(support::IDENTITY),
            Request::Setpoint { words } => {
                let mut word = [0];
                assert!(words.read_words(&mut word));
                self.total = self.total.wrapping_mul(3).wrapping_add(word[0]);
                Reply::Stepped { cost: 1, digest: self.total, output: specgen_link::Bytes(&[]) }
            }
            _ => Reply::Done,
        }
    }
}

impl Noisy {
    fn damage(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        for byte in bytes {
            let hit = self.random.next_u32() % self.rate == 0;
            match (hit, self.random.next_u32() % 4) {
                (false, _) => out.push(*byte),
                (true, 0) => {}
                (true, 1) => out.extend([*byte, *byte]),
                (true, _) => out.push(byte ^ (1 << (self.random.next_u32() % 8))),
            }
        }
        out
    }
}

impl Port for Noisy {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in self.damage(bytes) {
            if let Some(reply) = self.endpoint.push(byte, &mut self.device) {
                let reply = reply.to_vec();
                let damaged = self.damage(&reply);
                self.coming.extend(damaged);
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _limit: Duration) -> io::Result<usize> {
        let count = self.coming.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.coming[..count]);
        self.coming.drain(..count);
        Ok(count)
    }
}

#[test]
fn over_a_noisy_line_every_request_is_carried_out_exactly_once() {
    let port = Noisy {
        random: ChaCha8Rng::seed_from_u64(5),
        endpoint: Endpoint::new(),
        device: Sum::default(),
        coming: Vec::new(),
        rate: 60,
    };
    // No waiting: what does not come at once does not come.
    let timeout = Timeout { limit: Duration::ZERO, attempts: 200 };
    let (mut client, _) = Client::open(port, 7, timeout).unwrap();
    let mut total = 0_u64;
    for k in 0..20_000_u64 {
        total = total.wrapping_mul(3).wrapping_add(k);
        let bytes = k.to_le_bytes();
        let reply = client.ask(&Request::Setpoint { words: specgen_link::Bytes(&bytes) }).unwrap();
        let Reply::Stepped { digest, .. } = reply else { panic!("{reply:?}") };
        assert_eq!(digest, total, "request {k}");
    }
    let counters = *client.port().endpoint.counters();
    assert_eq!(counters.executed, 20_001);
    assert!(counters.repeated > 1000 && counters.checksum + counters.malformed > 1000, "{counters:?}");
    assert!(client.damaged() > 1000);
}

#[test]
fn a_silent_host_is_noticed_after_the_limit() {
    let mut silence = specgen_link::Silence::new(3);
    assert!(silence.tick(), "never heard");
    silence.heard();
    assert_eq!([0; 5].map(|_| silence.tick()), [false, false, false, true, true]);
    silence.heard();
    assert!(!silence.tick());
}
