//! What lies between the tick and the background.

use controller::Config;
use controller::supervised::{Cause, Phase, Request};
use specgen_link::Silence;

use crate::words::{COMMAND_WORDS, PERIOD_NANOSECONDS};

/// The link is lost after so long without a request, ns: 0.1 s.
const LINK_TIMEOUT: u32 = 100_000_000;

/// What the background wants of the ticks to come.
#[derive(Debug, Clone, Copy)]
pub struct Orders {
    /// Input words of the controller that are no measurements.
    pub command: [u64; COMMAND_WORDS],
    /// Of the supervisor; it holds for as long as it stands here.
    pub request: Request,
}

/// What the ticks have to say.
#[derive(Debug, Clone, Copy)]
pub struct Report {
    /// Ticks since power-up.
    pub tick: u64,
    /// What the machine does.
    pub phase: Phase,
    /// Why.
    pub cause: Cause,
    /// Whether the amplifiers are enabled.
    pub amplifier_on: bool,
    /// The controller's status word.
    pub status: u32,
    /// Events since they were last taken, as of `supervised`.
    pub events: u32,
    /// Ticks that never came.
    pub missed: u32,
    /// Ticks in which a converter was not believed.
    pub converter_faults: u32,
    /// Which [`Fault`](specgen_hal::Fault)s there were, by [`Fault::bit`](specgen_hal::Fault::bit).
    pub faults: u32,
    /// Largest delay of a tick's beginning, counts of the timer.
    pub latest: u32,
    /// Longest tick, counts of the timer.
    pub longest: u32,
}

impl Report {
    /// At power-up.
    pub const NONE: Self = Self {
        tick: 0,
        phase: Phase::Disarmed,
        cause: Cause::None,
        amplifier_on: false,
        status: 0,
        events: 0,
        missed: 0,
        converter_faults: 0,
        faults: 0,
        latest: 0,
        longest: 0,
    };
}

impl Report {
    /// A tick has run: when it began after it was due, and how long it took, counts of the timer.
    pub const fn took(&mut self, late: u32, duration: u32) {
        if late > self.latest {
            self.latest = late;
        }
        if duration > self.longest {
            self.longest = duration;
        }
    }
}

/// Orders one way, reports the other. Whoever holds it holds off the tick: copy and let go.
#[derive(Debug, Clone, Copy)]
pub struct Exchange {
    /// What is wanted.
    pub orders: Orders,
    /// Settings in force.
    pub config: Config,
    /// How it stands.
    pub report: Report,
    /// Counted up by the background, so that the tick sees it alive.
    pub beat: u32,
    /// Whether the host is still there.
    pub silence: Silence,
}

impl Default for Exchange {
    fn default() -> Self {
        Self::new()
    }
}

impl Exchange {
    /// At power-up: nothing wanted, the spec's settings, the link lost until the host is heard.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            orders: Orders { command: [0; COMMAND_WORDS], request: Request::None },
            config: Config::new(),
            report: Report::NONE,
            beat: 0,
            silence: Silence::new(LINK_TIMEOUT.div_ceil(PERIOD_NANOSECONDS)),
        }
    }
}
