//! The state machine once more, in other words: from `docs/supervisor.md`, not from the runtime. The tests of the emitted
//! controllers use it too.

pub const DISARMED: u8 = 0;
pub const ARMING: u8 = 1;
pub const RUNNING: u8 = 2;
pub const HOLDING: u8 = 3;
pub const RAMPING: u8 = 4;
pub const FAULTED: u8 = 5;
pub const DRIVING: u8 = 6;

pub const NOTHING: u64 = 0;
pub const ARM: u64 = 1;
pub const RUN: u64 = 2;
pub const HOLD: u64 = 3;
pub const RAMP_DOWN: u64 = 4;
pub const ACKNOWLEDGE: u64 = 5;
pub const DRIVE: u64 = 6;

/// Missed tick, link lost, integrity, converter, stop, stalled, fault of an amplifier.
pub const EVENTS: [u64; 7] = [1, 2, 4, 8, 16, STALLED, AMPLIFIER];
pub const STALLED: u64 = 128;
pub const AMPLIFIER: u64 = 64;
/// The cause of the last, and its bit in conditions.
pub const AMPLIFIER_FAULT: u8 = 17;
const AMPLIFIER_BIT: u8 = 31;
/// The end of the workspace in an open drive; its bit is the first.
pub const WORKSPACE: u8 = 18;

/// Which channel is looked at, tick by tick.
const TURNS: [usize; 36] =
    [2, 4, 0, 1, 5, 3, 1, 3, 5, 2, 4, 0, 4, 1, 0, 5, 2, 3, 3, 1, 2, 5, 0, 4, 2, 1, 3, 4, 0, 5, 5, 3, 4, 1, 2, 0];

/// What the section of `bench` makes of a spec.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Ticks of `arm_time` and the others of its kind.
    pub arm_ticks: u32,
    pub gauge_ticks: i64,
    pub voltage_ticks: i64,
    pub slew_ticks: i64,
    pub samples: i64,
    pub ticks_per_second: i64,
    /// Ticks until a host that is lost is gone.
    pub gone_ticks: i64,
    /// Of each axis, or of each leg: m, rad.
    pub tracking: [f64; 6],
    pub gauge_range: [f64; 2],
    /// What a fault of an amplifier leads to.
    pub amplifier: Act,
}

pub const DISAGREEMENT: f64 = 20e-6;
/// Ten times the noise of 2.2 nm, which is more than ten steps of the converter.
pub const STUCK_MOTION: f64 = 22e-9;

impl Bounds {
    /// Six legs of a stroke of 60 µm at a period of 200 µs.
    pub fn legs() -> Self {
        Self {
            arm_ticks: 10,
            gauge_ticks: 5,
            voltage_ticks: 10,
            slew_ticks: 5,
            samples: 3,
            ticks_per_second: 5000,
            // A host is lost after 2 ticks, in the third of silence; 7 ticks of silence are 1.4 ms.
            gone_ticks: 6,
            tracking: [6e-6; 6],
            gauge_range: [-2e-6, 48e-6],
            amplifier: Act::Off,
        }
    }

    /// The reference platform at 100 µs; a tenth of what its workspace is, and its gauges' range.
    pub fn platform(workspace: [f64; 6], gauge_range: [f64; 2]) -> Self {
        Self {
            arm_ticks: 20,
            gauge_ticks: 10,
            voltage_ticks: 20,
            slew_ticks: 10,
            samples: 6,
            ticks_per_second: 10_000,
            gone_ticks: 11,
            tracking: workspace.map(|full| 0.1 * full),
            gauge_range,
            amplifier: Act::Off,
        }
    }

    fn act(&self, cause: u8) -> Act {
        match cause {
            10 | 12 => Act::Off,
            1..=4 | 11 | 13 | 15 | WORKSPACE => Act::Ramp,
            AMPLIFIER_FAULT => self.amplifier,
            _ => Act::Hold,
        }
    }
}

/// What is done about a cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Act {
    Hold,
    Ramp,
    Off,
}

#[derive(Debug, Clone, Default)]
struct Channel {
    word: Option<u64>,
    expected: Vec<f64>,
    counts: [i64; 3],
    present: [bool; 3],
}

/// The supervisor.
#[derive(Debug, Clone)]
pub struct Oracle {
    bounds: Bounds,
    /// Armed since it last ran.
    fresh: bool,
    pub phase: u8,
    pub cause: u8,
    request: u64,
    arm_waits: bool,
    good: u32,
    /// What is present, by the bits of causes, and from bit 16 on the gauges or legs concerned.
    pub conditions: u64,
    /// Gauges that the last tick did not believe, legs that it held back.
    concerned: u64,
    /// Causes that the readings of the last tick showed, and their counts by cause.
    seen: Vec<u8>,
    counts: [i64; 16],
    channels: [Channel; 6],
    lasted: Vec<u8>,
    turn: usize,
}

impl Oracle {
    pub fn new(bounds: Bounds) -> Self {
        Self {
            bounds,
            fresh: true,
            phase: DISARMED,
            cause: 0,
            request: 0,
            arm_waits: false,
            good: 0,
            conditions: 0,
            concerned: 0,
            seen: Vec::new(),
            counts: [0; 16],
            channels: Default::default(),
            lasted: Vec::new(),
            turn: 0,
        }
    }

    /// The phase and cause of the coming interval.
    pub fn decide(&mut self, request: u64, events: u64, at_rest: bool) {
        let request = if request > DRIVE { HOLD } else { request };
        let new_request = std::mem::replace(&mut self.request, request) != request;
        let mut present = self.seen.clone();
        for (bit, cause) in EVENTS.into_iter().zip([8, 9, 10, 11, 12, 15, AMPLIFIER_FAULT]) {
            if events & bit != 0 {
                present.push(cause);
            }
        }
        for (kind, cause) in [3, 4, 5].into_iter().enumerate() {
            if self.channels.iter().any(|channel| channel.present[kind]) {
                present.push(cause);
            }
        }
        self.conditions = present.iter().fold(self.concerned << 16, |bits, cause| {
            bits | 1
                << match *cause {
                    AMPLIFIER_FAULT => AMPLIFIER_BIT,
                    WORKSPACE => 0,
                    other => other,
                }
        });
        for (gauge, channel) in self.channels.iter().enumerate() {
            self.conditions |= u64::from(channel.present.contains(&true)) << (16 + gauge);
        }
        let mut lasted = std::mem::take(&mut self.lasted);
        for cause in [1, 2, 6, 7, 8, 11, 13_u8] {
            // A host that is lost: after a while nobody waits for it.
            let shown = if cause == 13 { 9 } else { cause };
            let (limit, weight) = match cause {
                13 => (self.bounds.gone_ticks, 1),
                6 => (self.bounds.voltage_ticks, 1),
                7 => (self.bounds.slew_ticks, 1),
                8 => (self.bounds.ticks_per_second + 1, self.bounds.ticks_per_second),
                // A sample that is missing, in one tick, takes as long as four without to be forgotten.
                _ => (4 * self.bounds.gauge_ticks, 4),
            };
            let count = &mut self.counts[usize::from(cause)];
            *count = if present.contains(&shown) { (*count + weight).min(limit) } else { (*count - 1).max(0) };
            if present.contains(&shown) && *count == limit {
                lasted.push(cause);
            }
        }
        lasted.extend(present.iter().filter(|cause| matches!(**cause, 9 | 10 | 12 | 15 | WORKSPACE)));
        // Amplifiers that are off anyway are not minded.
        lasted.extend(present.iter().filter(|cause| **cause == AMPLIFIER_FAULT && self.phase != DISARMED));
        lasted.sort_unstable();
        let strongest = lasted.iter().map(|cause| self.bounds.act(*cause)).max();
        let bounds = self.bounds.clone();
        let first = |least: Act| lasted.iter().copied().find(|cause| bounds.act(*cause) >= least).unwrap_or(0);
        let well = present.is_empty();

        if strongest == Some(Act::Off) && self.phase != FAULTED {
            return self.enter(FAULTED, first(Act::Off));
        }
        match self.phase {
            DISARMED => {
                self.arm_waits = request == ARM && (new_request || self.arm_waits);
                if self.arm_waits && well && at_rest {
                    self.arm_waits = false;
                    self.enter(ARMING, 0);
                }
            }
            ARMING if strongest.is_some() => self.enter(RAMPING, first(Act::Hold)),
            ARMING if request == RAMP_DOWN => self.enter(RAMPING, 0),
            ARMING => {
                self.good = if well { self.good + 1 } else { 0 };
                if self.good == self.bounds.arm_ticks {
                    self.enter(if request == RUN { RUNNING } else { HOLDING }, 0);
                }
            }
            RUNNING | HOLDING | DRIVING if strongest == Some(Act::Ramp) => self.enter(RAMPING, first(Act::Ramp)),
            RUNNING | DRIVING if request == RAMP_DOWN => self.enter(RAMPING, first(Act::Hold)),
            RUNNING if strongest.is_some() || request == HOLD => self.enter(HOLDING, first(Act::Hold)),
            DRIVING if strongest.is_some() || request != DRIVE && request != NOTHING => {
                self.enter(HOLDING, first(Act::Hold));
            }
            HOLDING => {
                if self.cause == 0 {
                    self.cause = first(Act::Hold);
                }
                if request == RAMP_DOWN {
                    self.enter(RAMPING, self.cause);
                } else if request == ACKNOWLEDGE && new_request && well {
                    self.cause = 0;
                } else if request == RUN && well && (new_request || self.cause == 0) {
                    self.enter(RUNNING, 0);
                } else if request == DRIVE && well && (new_request || self.cause == 0) {
                    self.enter(DRIVING, 0);
                }
            }
            RAMPING => {
                if self.cause == 0 {
                    self.cause = first(Act::Hold);
                }
                if at_rest {
                    self.enter(if self.cause == 0 { DISARMED } else { FAULTED }, self.cause);
                }
            }
            FAULTED if request == ACKNOWLEDGE && new_request && well && at_rest => self.enter(DISARMED, 0),
            _ => {}
        }
    }

    fn enter(&mut self, phase: u8, cause: u8) {
        self.fresh |= phase == ARMING || phase == DRIVING;
        self.phase = phase;
        self.cause = cause;
        self.good = 0;
        if phase != HOLDING && phase != RAMPING {
            self.counts = [0; 16];
            self.channels = Default::default();
            self.lasted.clear();
        }
    }

    /// Whether the law begins with this phase, and anew: armed since it last ran.
    pub fn begins_anew(&mut self, ran: bool) -> bool {
        !ran && self.phase == RUNNING && std::mem::take(&mut self.fresh)
    }

    /// The pose that the tick has measured is near the end of the workspace. After [`Oracle::observe`].
    pub fn nears_the_end(&mut self) {
        if self.phase == DRIVING {
            self.seen.push(WORKSPACE);
        }
    }

    /// What a tick shows: the gauges' words and values, what the gauges ought to read, how far each axis or leg is from its
    /// set-point, the codes before and after the tick, its status.
    #[allow(clippy::too_many_arguments)] // What a tick shows, one by one.
    pub fn observe(
        &mut self,
        words: &[u64],
        readings: &[f64; 6],
        expected: &[f64; 6],
        errors: &[f64; 6],
        codes: [&[i64; 6]; 2],
        status: u64,
        max_step: i64,
    ) {
        self.seen.clear();
        self.concerned = 0;
        let turn = TURNS[self.turn];
        self.turn = (self.turn + 1) % TURNS.len();
        let mut believed = true;
        for leg in 0..6 {
            let reading = readings[leg];
            if !reading.is_finite() {
                self.seen.push(1);
                self.concerned |= 1 << leg;
                believed = false;
            } else if !(self.bounds.gauge_range[0]..=self.bounds.gauge_range[1]).contains(&reading) {
                self.seen.push(2);
                self.concerned |= 1 << leg;
                believed = false;
            }
            if matches!(self.phase, RUNNING | DRIVING) && status >> leg & 1 == 1 {
                let slewed = (codes[1][leg] - codes[0][leg]).abs() >= max_step;
                self.seen.push(if slewed { 7 } else { 6 });
                self.concerned |= 1 << leg;
            }
        }
        if !believed || !matches!(self.phase, ARMING | RUNNING | HOLDING | DRIVING) {
            return;
        }
        let channel = &mut self.channels[turn];
        if channel.word != Some(words[turn]) {
            channel.word = Some(words[turn]);
            channel.expected.clear();
        }
        channel.expected.push(expected[turn]);
        let least = channel.expected.iter().copied().fold(f64::INFINITY, f64::min);
        let most = channel.expected.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let tracks = self.phase == RUNNING && errors[turn].abs() > self.bounds.tracking[turn];
        // Legs of an open drive may not be those of the model.
        let disagrees = self.phase != DRIVING && (readings[turn] - expected[turn]).abs() > DISAGREEMENT;
        let present = [most - least > STUCK_MOTION, disagrees, tracks];
        for (kind, (present, cause)) in present.into_iter().zip([3, 4, 5]).enumerate() {
            let count = &mut channel.counts[kind];
            *count = match (present, kind) {
                (true, _) => (*count + 1).min(self.bounds.samples),
                (false, 0) => 0,
                (false, _) => (*count - 1).max(0),
            };
            channel.present[kind] = present;
            if present && *count == self.bounds.samples {
                self.lasted.push(cause);
            }
        }
    }
}
