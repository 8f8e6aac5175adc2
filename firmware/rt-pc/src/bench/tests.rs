//! A simulated machine for tests: legs that follow their codes, gauges that measure the legs, and injected faults. The
//! loop runs on it as fast as possible, in the thread of the test.

use core::sync::atomic::Ordering;

use controller::hysteresis::{Memory, TABLES};
use controller::limits::DAC;
use controller::sensing::CONVERTER;
use controller::snapshot::recorder;
use controller::supervised::{Cause, Finding, MACHINE_INPUT_WORDS, MachineInput, Phase, Request};
use controller::supervision::READINGS_PER_LEG;
use controller::{Config, PLACE_WORDS, Real};
use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};
use specgen_link::EdgeStatus;
use specgen_rt::account::Account;
use specgen_rt::{allocation, clock};

use crate::control::{Loop, Timing};
use crate::devices::{Contacts, Device};
use crate::handover::{LoopCommand, OperatorRequest, Outer, Row, Shared, rings};
use crate::operator::SupervisorReport;
use crate::options::{self, Invocation, Options};

/// Gauges in the middle of their range.
const MIDDLE: i32 = 1 << 16;
/// Rows and calls that fit without an allocation.
const ROOM: usize = 1 << 16;
/// Time waits for the loop, which never sleeps.
pub const FAST: Timing = Timing { period: 1, limit: 1_000_000_000, silence: 1 << 40, elastic: true };

/// A call of the loop to the amplifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    Write([i32; CHANNELS]),
    Enable(bool),
}

/// Calls that fail from now on.
#[derive(Debug, Clone, Copy, Default)]
pub struct InjectedFaults {
    pub read: bool,
    pub beat: bool,
    pub write: bool,
    pub enable: bool,
    pub disable: bool,
}

/// Action of a test at the beginning of every tick.
type Script = Box<dyn FnMut(&mut Bench) + Send>;

pub struct Bench {
    legs: [Memory; CHANNELS],
    gauges: [i32; CHANNELS],
    pub broken: InjectedFaults,
    pub contacts: Contacts,
    pub tick: u64,
    /// Tick of the first row that shows it running.
    ran: Option<u64>,
    /// Ticks in which the loop gave its sign of life.
    pub beats: Vec<u64>,
    /// How often the output lines were set.
    pub sets: usize,
    /// In order, with the tick of each.
    pub calls: Vec<(u64, Call)>,
    /// Rows from the loop, in order.
    pub rows: Vec<Row>,
    pub outer: Outer,
    pub shared: &'static Shared,
    script: Option<Script>,
}

impl Bench {
    /// With a script that is called at the beginning of every tick; it has to stop the loop.
    pub fn new(outer: Outer, script: impl FnMut(&mut Self) + Send + 'static) -> Self {
        let shared: &'static Shared = Box::leak(Box::default());
        shared.service_alive.store(clock::now(), Ordering::Relaxed);
        Self {
            legs: [Memory::new(); CHANNELS],
            gauges: [MIDDLE; CHANNELS],
            broken: InjectedFaults::default(),
            contacts: Contacts::default(),
            tick: 0,
            ran: None,
            beats: Vec::with_capacity(ROOM),
            sets: 0,
            calls: Vec::with_capacity(ROOM),
            rows: Vec::with_capacity(ROOM / 4),
            outer,
            shared,
            script: Some(Box::new(script)),
        }
    }

    pub fn stop(&self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }

    /// A command for the loop, which takes it after this tick.
    pub fn queue(&mut self, command: LoopCommand) {
        self.outer.commands.push(command).expect("room for a command");
    }

    pub fn ask(&mut self, request: Request) {
        self.queue(LoopCommand::Request(OperatorRequest { command: None, request }));
    }

    /// Phase after the last tick.
    pub fn phase(&self) -> Phase {
        self.rows.last().map_or(Phase::Disarmed, phase)
    }

    /// Arms and runs, and runs again after a hold; returns the ticks since the first run, none before.
    pub fn arm_and_run(&mut self) -> Option<u64> {
        match (self.tick, self.phase()) {
            (1, _) => self.ask(Request::Arm),
            (_, Phase::Holding) if self.since(Phase::Holding) == 1 => self.ask(Request::Run),
            (5500, _) if self.ran.is_none() => panic!("it never runs: {:?}", self.rows.last()),
            (tick, Phase::Running) => self.ran = self.ran.or(Some(tick - 1)),
            _ => {}
        }
        self.ran.map(|ran| self.tick - ran)
    }

    /// Ticks since it entered a phase.
    fn since(&self, wanted: Phase) -> usize {
        self.rows.iter().rev().take_while(|row| phase(row) == wanted).count()
    }

    fn call(&mut self, call: Call, fails: bool, fault: Fault) -> Result<(), Fault> {
        self.calls.push((self.tick, call));
        if fails { Err(fault) } else { Ok(()) }
    }
}

/// What a command line asks for.
pub fn parsed(line: &str) -> Result<Invocation, String> {
    options::parse(std::iter::once("rt-pc").chain(line.split_whitespace()).map(Into::into))
}

/// Options of a run.
pub fn options(line: &str) -> Options {
    match parsed(line) {
        Ok(Invocation::Run(options)) => *options,
        other => panic!("{line}: {other:?}"),
    }
}

/// The first words of each block of a file of records.
pub fn blocks(bytes: &[u8]) -> Vec<[u64; 5]> {
    let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let mut at = 16 + (word(8) >> 32) as usize + 8;
    let mut blocks = Vec::new();
    while at < bytes.len() {
        blocks.push([0, 8, 16, 24, 32].map(|place| word(at + place)));
        at += (word(at + 8) as usize + 1) * 8;
    }
    blocks
}

/// Row of a tick of an idle machine.
pub fn row(tick: u64) -> Row {
    Row {
        tick,
        count: tick,
        input: MachineInput::from_words(&[0; MACHINE_INPUT_WORDS]),
        output: recorder::Row { codes: [0; 6], status: 0, supervisor: 0 },
        place: [0; PLACE_WORDS],
        digest: 0,
        late: 0,
        commands: 0,
        opens: false,
        waving: false,
        edge: EdgeStatus::NONE,
        recorded: None,
        triggered: false,
    }
}

/// Report of the supervisor in tick 7.
pub fn said(phase: Phase) -> SupervisorReport {
    SupervisorReport {
        phase,
        cause: Cause::None,
        finding: Finding::None,
        on: phase.is_powered(),
        status: 0,
        tick: 7,
        commands: 0,
        waving: false,
        late: 0,
    }
}

pub fn phase(row: &Row) -> Phase {
    Phase::from_word(u64::from(row.output.supervisor & 0xff)).expect("a phase")
}

pub fn is_on(row: &Row) -> bool {
    row.output.supervisor >> 16 & 1 == 1
}

/// The loop on a machine, until the script stops it.
pub fn run(timing: Timing, script: impl FnMut(&mut Bench) + Send + 'static) -> (Bench, Account) {
    let (inner, outer) = rings(false);
    let mut bench = Bench::new(outer, script);
    let mut account = Account::new(timing.period, timing.limit);
    let shared = bench.shared;
    let control = Loop {
        device: &mut bench,
        config: Config::new(),
        standing_events: 0,
        rings: inner,
        tape: None,
        shared,
        timing,
    };
    control.run(&mut account);
    bench.collect();
    (bench, account)
}

impl Bench {
    fn collect(&mut self) {
        while let Ok(row) = self.outer.rows.pop() {
            self.rows.push(row);
        }
    }
}

impl Gauges for Bench {
    const BITS: u32 = 17;

    fn read(&mut self) -> Result<[i32; CHANNELS], Fault> {
        if self.broken.read { Err(Fault::Bus) } else { Ok(self.gauges) }
    }
}

impl Amplifiers for Bench {
    const BITS: u32 = 16;

    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        for ((leg, table), code) in self.legs.iter_mut().zip(&TABLES).zip(codes) {
            leg.apply(table, DAC.drive(*code));
        }
        self.gauges = READINGS_PER_LEG.map(|row| {
            let moved: Real = row.iter().zip(&self.legs).map(|(part, leg)| part * leg.displacement()).sum();
            MIDDLE + (moved / CONVERTER.per_code).round() as i32
        });
        self.call(Call::Write(*codes), self.broken.write, Fault::Bus)
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        let fails = if on { self.broken.enable } else { self.broken.disable };
        self.call(Call::Enable(on), fails, Fault::Pin)
    }
}

impl Lines for Bench {
    const COUNT: usize = 0;
    const INPUT: bool = true;

    fn set(&mut self, _high: u32) -> Result<(), Fault> {
        self.sets += 1;
        Ok(())
    }

    fn input(&mut self) -> Result<bool, Fault> {
        Ok(false)
    }
}

impl Device for Bench {
    fn tick(&mut self, tick: u64) {
        // The script is not part of the loop.
        allocation::leave();
        self.tick = tick;
        self.collect();
        if let Some(mut script) = self.script.take() {
            script(self);
            self.script = Some(script);
        }
        allocation::enter();
    }

    fn beat(&mut self) -> Result<Contacts, Fault> {
        self.beats.push(self.tick);
        if self.broken.beat { Err(Fault::Pin) } else { Ok(self.contacts) }
    }

    fn wrench(&self) -> [f64; CHANNELS] {
        [0.0; CHANNELS]
    }

    fn describe(&self) -> String {
        "made-up machine".to_owned()
    }
}
