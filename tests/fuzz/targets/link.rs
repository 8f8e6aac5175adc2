//! Both ends of the link, each with the other end out of its mind.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use controller::limits::CODES;
use controller::sensing::CONVERTER;
use controller::supervised::{Machine, machine_at_reset};
use controller::supervision::READINGS_PER_LEG;
use controller::{Config, LEGS, LegState};
use specgen::operate::Session;
use specgen_board::{
    Board, Exchange, LinkHandler, MachineSnapshot, RequestContext, SampleMemory, Stopwatch, TargetStatus, catch_up,
    gather,
};
use specgen_hal::{Amplifiers, Fault, Gauges};
use specgen_link::client::{Port, Timeout};
use specgen_link::{Endpoint, Kind, Receiver, RecorderAction, VERSION};
use specgen_runtime::supervisor::Request;

/// Most ticks of a board: 0.6 s, enough to arm and run.
const TICKS: u32 = 6000;

/// The input is a script of both ends.
pub fn link(input: &[u8]) {
    device(input);
    host(input);
}

/// What a script says next: what to do, and bytes for it.
fn next<'a>(script: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let (&[what, low, high], rest) = script.split_first_chunk()?;
    let length = usize::from(u16::from_le_bytes([low, high]) % 1200).min(rest.len());
    let (bytes, rest) = rest.split_at(length);
    *script = rest;
    Some((what, bytes))
}

/// A frame of a header and a message, as `specgen_link` describes it.
fn frame(header: [u8; 6], message: &[u8]) -> Vec<u8> {
    let mut body = [&header, message].concat();
    let crc = body.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0x82f6_3b78 } else { crc >> 1 })
    });
    body.extend((!crc).to_le_bytes());
    let mut out = Vec::new();
    for piece in body.split(|byte| *byte == 0) {
        let mut rest = piece;
        while let Some((whole, after)) = rest.split_at_checked(254) {
            out.push(255);
            out.extend_from_slice(whole);
            rest = after;
        }
        out.push(rest.len() as u8 + 1);
        out.extend_from_slice(rest);
    }
    out.push(0);
    out
}

fn header(kind: u8, session: u16, sequence: u16) -> [u8; 6] {
    let ([session_low, session_high], [sequence_low, sequence_high]) = (session.to_le_bytes(), sequence.to_le_bytes());
    [VERSION, kind, session_low, session_high, sequence_low, sequence_high]
}

/// Converters: codes of the gauges, and what was last sent to the amplifiers.
#[derive(Clone, Default)]
struct Parts(Rc<RefCell<State>>);

#[derive(Default)]
struct State {
    gauges: [i32; 6],
    fails: bool,
    written: Option<[i32; 6]>,
    enabled: bool,
}

impl Parts {
    /// What the gauges read next.
    fn read(&self, legs: &[LegState; LEGS], off: i32, fails: bool) {
        let mut state = self.0.borrow_mut();
        state.fails = fails;
        for (code, row) in state.gauges.iter_mut().zip(READINGS_PER_LEG) {
            let reading: f64 = row.iter().zip(legs).map(|(part, leg)| part * leg.memory.displacement()).sum();
            *code = ((reading - CONVERTER.at_zero) / CONVERTER.per_code) as i32 + off;
        }
    }
}

impl Gauges for Parts {
    const BITS: u32 = 17;

    fn read(&mut self) -> Result<[i32; 6], Fault> {
        let state = self.0.borrow();
        if state.fails { Err(Fault::Blank) } else { Ok(state.gauges) }
    }
}

impl Amplifiers for Parts {
    const BITS: u32 = 16;

    fn write(&mut self, codes: &[i32; 6]) -> Result<(), Fault> {
        let mut state = self.0.borrow_mut();
        assert!(codes.iter().all(|code| (CODES[0]..=CODES[1]).contains(code)), "voltage: {codes:?}");
        if let (true, Some(last)) = (state.enabled, state.written) {
            let most = Config::new().code_limits.max_step;
            assert!(
                codes.iter().zip(last).all(|(code, last)| (code - last).abs() <= most),
                "slew: {last:?} to {codes:?}"
            );
        }
        state.written = Some(*codes);
        Ok(())
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        self.0.borrow_mut().enabled = on;
        Ok(())
    }
}

/// Memories of a recorder and of samples. A board has them for ever; here they are given back after each input, of which there are millions.
struct Tape(*mut [u64], *mut MachineSnapshot, *mut SampleMemory);

#[allow(unsafe_code)]
impl Tape {
    fn new() -> Self {
        let samples = Box::into_raw(Box::new(SampleMemory::new()));
        Self(Box::into_raw(vec![0; 4000].into_boxed_slice()), Box::into_raw(Box::new(MachineSnapshot::new())), samples)
    }

    /// To be called once, by what is dropped before this is.
    fn memories(&self) -> (&'static mut [u64], &'static mut MachineSnapshot, &'static mut SampleMemory) {
        // SAFETY: they are there until this is dropped, and nobody else has them.
        unsafe { (&mut *self.0, &mut *self.1, &mut *self.2) }
    }
}

#[allow(unsafe_code)]
impl Drop for Tape {
    fn drop(&mut self) {
        // SAFETY: made by `Box::into_raw`, and given back once.
        drop(unsafe { (Box::from_raw(self.0), Box::from_raw(self.1), Box::from_raw(self.2)) });
    }
}

/// A board keeps voltage and slew limits and answers in frames, whatever its line and its gauges say.
fn device(mut script: &[u8]) {
    let parts = Parts::default();
    let tape = Tape::new();
    let mut machine = Box::new(machine_at_reset());
    let mut board = Board::new(parts.clone(), parts.clone(), &mut machine, true);
    let mut exchange = Exchange::new();
    let (words, kept, samples) = tape.memories();
    exchange.record(words, kept);
    exchange.show(samples, 921_600);
    board.start(&mut exchange.report);
    let (mut handler, mut endpoint, mut host) = (LinkHandler::new(Stopwatch::NONE), Endpoint::new(), Receiver::new());
    let (mut sequence, mut ticks) = (0, 0);
    while let Some((what, bytes)) = next(&mut script) {
        let sent = match what % 4 {
            0 => bytes.to_vec(),
            1 => frame(header(0, 1, sequence), bytes),
            2 => match bytes.split_first_chunk() {
                Some((header, message)) => frame(*header, message),
                None => continue,
            },
            _ => {
                // Up to 2040 ticks, in which the gauges read what the legs' models say, off by so much, or nothing at all.
                let [count, fails, low, high] = *bytes.first_chunk().unwrap_or(&[0; 4]);
                let count = (u32::from(count) * 8).min(TICKS - ticks);
                ticks += count;
                for _ in 0..count {
                    let off = i32::from(i16::from_le_bytes([low, high])) * 4;
                    parts.read(&board.machine().state.legs, off, fails == 1);
                    board.tick(&mut exchange, TargetStatus::default());
                }
                catch_up(&mut |action| action(&mut exchange, board.machine_mut()), || true);
                gather(&mut |action| action(&mut exchange, board.machine_mut()));
                continue;
            }
        };
        let before = endpoint.counters().executed;
        for byte in sent {
            let mut with =
                |action: &mut dyn FnMut(&mut Exchange, &mut Machine)| action(&mut exchange, board.machine_mut());
            let reply = endpoint.push(byte, &mut RequestContext { handler: &mut handler, with: &mut with });
            for byte in reply.unwrap_or_default() {
                if let Some(answer) = host.push(*byte) {
                    assert_eq!(answer.unwrap().0.kind, Kind::Reply);
                }
            }
        }
        if endpoint.counters().executed != before {
            sequence += 1;
        }
    }
}

/// A device that answers what the script says.
struct Answers<'a> {
    script: &'a [u8],
    asked: Receiver,
    session: u16,
    sequence: u16,
    coming: Vec<u8>,
}

impl Port for Answers<'_> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            if let Some(request) = self.asked.push(*byte) {
                let (header, _) = request.unwrap();
                (self.session, self.sequence) = (header.session, header.sequence);
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _limit: Duration) -> io::Result<usize> {
        if self.coming.is_empty() {
            let (what, bytes) = next(&mut self.script).ok_or(io::ErrorKind::UnexpectedEof)?;
            self.coming = match what % 4 {
                0 => bytes.to_vec(),
                1 => frame(header(1, self.session, self.sequence), bytes),
                2 => frame(header(2, 0, 0), bytes),
                _ => frame(header(1, self.session, self.sequence.wrapping_sub(1)), bytes),
            };
        }
        let count = self.coming.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.coming[..count]);
        self.coming.drain(..count);
        Ok(count)
    }
}

/// A host gets through, or says why not.
fn host(script: &[u8]) {
    let port = Answers { script, asked: Receiver::new(), session: 0, sequence: 0, coming: Vec::new() };
    let timeout = Timeout { limit: Duration::from_secs(1000), attempts: 1 };
    let mut session = match Session::open(port, timeout, None) {
        Ok(session) => session,
        Err(why) => return assert!(!why.to_string().is_empty()),
    };
    let words = session.assign(&[("setpoint[0]".to_owned(), "1e-6".to_owned())]).unwrap_or_default();
    // Each has its own answer, and none is owed anything by those before it.
    let _ = session.supervise(Request::Arm);
    let _ = session.config();
    let _ = session.recorder(RecorderAction::Look);
    let _ = session.download_part(&mut Vec::new());
    let _ = session.command(words);
    let _ = session.poll();
    let _ = session.stream(7);
    let blocks = session.take_blocks().unwrap_or_default();
    assert!(blocks.iter().all(|block| block.end() >= block.tick && !block.rows.is_empty()));
}
