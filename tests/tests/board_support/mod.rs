//! A board on converters that do what the controller's model says, with a host at the other end of its link. Time passes while
//! the host waits for an answer.

#![allow(dead_code)] // Each test uses its part.
#![allow(clippy::unwrap_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use controller::sensing::CONVERTER;
use controller::supervised::{Machine, Phase, machine_at_reset};
use controller::supervision::READINGS_PER_LEG;
use controller::{PLACE_WORDS, Real, place_words};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_board::{
    Board, Exchange, LinkHandler, MachineSnapshot, RequestContext, SampleMemory, Stopwatch, TargetStatus, catch_up,
    gather, learn,
};
use specgen_hal::{Amplifiers, Fault, Gauges, Lines};
use specgen_link::Endpoint;
use specgen_link::client::{Client, ClientError, Port, Timeout};
use specgen_link::{Refusal, Reply, Request};
use specgen_runtime::wave::{AxisWave, Settings, Shape, Tone, step_of};

/// Converters: codes of the gauges, and the last codes for the amplifiers.
#[derive(Clone, Default)]
pub struct Parts(Rc<RefCell<State>>);

#[derive(Default)]
pub struct State {
    pub gauges: [i32; 6],
    pub fails: bool,
    pub written: Option<[i32; 6]>,
    pub enabled: bool,
    /// Times that the amplifiers were switched on.
    pub switched_on: u32,
    /// The input line.
    pub input: bool,
    /// The input line does not answer.
    pub input_fails: bool,
    /// The output lines, bit by bit.
    pub lines: u32,
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

    fn start(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn write(&mut self, codes: &[i32; 6]) -> Result<(), Fault> {
        self.0.borrow_mut().written = Some(*codes);
        Ok(())
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        let mut state = self.0.borrow_mut();
        state.switched_on += u32::from(on && !state.enabled);
        state.enabled = on;
        Ok(())
    }
}

/// As many as any controller of these tests has.
impl Lines for Parts {
    const COUNT: usize = 1;
    const INPUT: bool = true;

    fn set(&mut self, high: u32) -> Result<(), Fault> {
        self.0.borrow_mut().lines = high;
        Ok(())
    }

    fn input(&mut self) -> Result<bool, Fault> {
        let state = self.0.borrow();
        if state.input_fails { Err(Fault::Pin) } else { Ok(state.input) }
    }
}

/// Most knots of a pass.
pub const KNOTS_OF_A_PASS: usize = 64;

pub struct Rig {
    pub board: Board<'static, Parts, Parts, Parts>,
    pub exchange: Exchange,
    pub parts: Parts,
    handler: LinkHandler,
    endpoint: Endpoint,
    noise: ChaCha8Rng,
    answers: VecDeque<u8>,
    /// Of a hundred bytes, how many are spoilt on their way, in either direction.
    pub spoilt: u32,
    /// Ticks that pass while an answer is waited for.
    pub pace: u32,
    /// The background has no time for samples.
    pub busy: bool,
    /// What every tick showed, where it is wanted.
    pub shown: Option<Vec<SampleKey>>,
}

/// A tick: its number, status, phase, and where the platform was.
pub type SampleKey = (u64, u32, u8, [u64; PLACE_WORDS]);

/// The rig as a line, and to look at.
#[derive(Clone)]
pub struct Line(pub Rc<RefCell<Rig>>);

impl Line {
    /// At power-up, with a recorder of so many words.
    pub fn new(record: usize) -> Self {
        let parts = Parts::default();
        let machine = Box::leak(Box::new(machine_at_reset()));
        let mut board = Board::with_lines(parts.clone(), parts.clone(), parts.clone(), machine, true);
        let mut exchange = Exchange::new();
        exchange.record(Box::leak(vec![0; record].into_boxed_slice()), Box::leak(Box::new(MachineSnapshot::new())));
        exchange.show(Box::leak(Box::new(SampleMemory::new())), 921_600);
        exchange.play(Box::leak(vec![[0; 6]; 2 * KNOTS_OF_A_PASS].into_boxed_slice()));
        board.start(&mut exchange.report);
        exchange.prepare();
        Self(Rc::new(RefCell::new(Rig {
            board,
            exchange,
            parts,
            handler: LinkHandler::new(Stopwatch::NONE),
            endpoint: Endpoint::new(),
            noise: ChaCha8Rng::seed_from_u64(3),
            answers: VecDeque::new(),
            spoilt: 0,
            pace: 3,
            busy: false,
            shown: None,
        })))
    }

    /// A host that asks again as often as it takes.
    pub fn client(&self, session: u16) -> Client<Self> {
        let timeout = Timeout { limit: Duration::from_micros(1), attempts: 1000 };
        Client::open(self.clone(), session, timeout).unwrap().0
    }

    pub fn tick(&self, count: u32) {
        let mut rig = self.0.borrow_mut();
        for _ in 0..count {
            rig.tick();
        }
    }

    pub fn phase(&self) -> Phase {
        self.0.borrow().exchange.report.phase
    }

    pub fn with<R>(&self, look: impl FnOnce(&mut Rig) -> R) -> R {
        look(&mut self.0.borrow_mut())
    }

    pub fn parts<R>(&self, look: impl FnOnce(&mut State) -> R) -> R {
        self.with(|rig| look(&mut rig.parts.0.borrow_mut()))
    }
}

impl Rig {
    /// One tick; the gauges then read what the legs' models say, with a little noise.
    pub fn tick(&mut self) {
        let Self { board, exchange, .. } = self;
        board.tick(exchange, TargetStatus::default());
        // The background, as after every tick.
        catch_up(&mut |action| action(exchange, board.machine_mut()), || true);
        if !self.busy {
            gather(&mut |action| action(exchange, board.machine_mut()));
            learn(&mut |action| action(exchange, board.machine_mut()));
        }
        if let Some(shown) = &mut self.shown {
            let report = &self.exchange.report;
            let place = place_words(&self.board.machine().state);
            shown.push((report.tick - 1, report.status, report.phase.word() as u8, place));
        }
        let legs = self.board.machine().state.legs;
        let mut state = self.parts.0.borrow_mut();
        for (code, row) in state.gauges.iter_mut().zip(READINGS_PER_LEG) {
            let reading: Real = row.iter().zip(&legs).map(|(part, leg)| part * leg.memory.displacement()).sum();
            let noise = self.noise.next_u32() % 5;
            *code = ((reading - CONVERTER.at_zero) / CONVERTER.per_code) as i32 + noise as i32 - 2;
        }
    }

    fn spoil(&mut self, byte: u8) -> Option<u8> {
        let (share, what) = (self.noise.next_u32() % 1000, self.noise.next_u32());
        if share >= self.spoilt {
            return Some(byte);
        }
        // Lost, or with a bit flipped.
        if what % 2 == 0 { None } else { Some(byte ^ (1 << ((what >> 8) % 8))) }
    }
}

impl Port for Line {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut rig = self.0.borrow_mut();
        for byte in bytes {
            let Some(byte) = rig.spoil(*byte) else { continue };
            let Rig { board, exchange, handler, endpoint, .. } = &mut *rig;
            let mut with = |action: &mut dyn FnMut(&mut Exchange, &mut Machine)| action(exchange, board.machine_mut());
            let answer = endpoint.push(byte, &mut RequestContext { handler, with: &mut with }).map(<[u8]>::to_vec);
            for byte in answer.unwrap_or_default() {
                if let Some(byte) = rig.spoil(byte) {
                    rig.answers.push_back(byte);
                }
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _limit: Duration) -> io::Result<usize> {
        let pace = self.0.borrow().pace;
        self.tick(pace);
        let mut rig = self.0.borrow_mut();
        let count = rig.answers.len().min(buffer.len());
        for (slot, byte) in buffer.iter_mut().zip(rig.answers.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

pub fn bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

pub fn done(client: &mut Client<Line>, request: &Request<'_>) {
    assert_eq!(client.ask(request).unwrap(), Reply::Done, "{request:?}");
}

pub fn refused(client: &mut Client<Line>, request: &Request<'_>) -> Refusal {
    match client.ask(request) {
        Err(ClientError::Refused(refusal)) => refusal,
        other => panic!("{request:?}: {other:?}"),
    }
}

/// Asks for status until the machine is where it is to be.
pub fn wait(line: &Line, client: &mut Client<Line>, what: &str, mut there: impl FnMut(&Line) -> bool) {
    for _ in 0..20_000 {
        client.ask(&Request::Status).unwrap();
        if there(line) {
            return;
        }
    }
    panic!("{what}: still {:?}", line.with(|rig| rig.exchange.report));
}

/// Armed, running, at the bias pose.
pub fn running(line: &Line, client: &mut Client<Line>) {
    line.with(|rig| rig.pace = 50);
    done(client, &Request::Supervise { request: 1 });
    wait(line, client, "arming", |line| line.phase() == Phase::Arming);
    done(client, &Request::Supervise { request: 2 });
    wait(line, client, "running", |line| line.phase() == Phase::Running);
    let busy = |line: &Line| line.with(|rig| rig.exchange.report.status & controller::GENERATOR_BUSY != 0);
    wait(line, client, "bias", |line| !busy(line));
    line.with(|rig| rig.pace = 3);
}

pub fn wave(amplitude: f64, frequency: f64) -> Settings<f64> {
    let mut settings = Settings::still();
    for (axis, wave) in settings.axes.iter_mut().enumerate() {
        let scale = if axis < 3 { 1.0 } else { 10.0 };
        let tone = Tone {
            amplitude: amplitude * scale,
            phase: 0,
            step: step_of(frequency + axis as f64, controller::PERIOD_SECONDS),
        };
        *wave = AxisWave { offset: 0.0, shape: Shape::Sine { tone } };
    }
    settings.ramp_ticks = 300;
    settings
}
