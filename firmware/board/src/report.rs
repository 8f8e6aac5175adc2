//! Results of the ticks, and what measures them.

use controller::supervised::{Cause, Phase};
use specgen_hal::Fault;
use specgen_link::{CostUnit, Counters, Health, Status};
use specgen_runtime::supervisor::OF_GAUGES;

/// Probes of times and stack.
#[derive(Debug, Clone, Copy)]
pub struct Probes {
    /// Frequency of the counter that times ticks, Hz; 0 without a counter.
    pub hertz: u32,
    /// Peak use of the stack and its size, bytes. Takes some µs: for the background.
    pub stack: fn() -> [u32; 2],
    /// Reset cause: bits of [`reset_cause`](specgen_link::reset_cause).
    pub reset_cause: u8,
}

impl Probes {
    /// No probes: on a host.
    pub const NONE: Self = Self { hertz: 0, stack: || [0; 2], reset_cause: 0 };
}

/// Counter of a tick's cost.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch {
    /// What it counts.
    pub counted: CostUnit,
    /// The counter, which wraps around. Read while nothing interrupts.
    pub now: fn() -> u32,
}

impl Stopwatch {
    /// No counter: on a host.
    pub const NONE: Self = Self { counted: CostUnit::Nothing, now: || 0 };
}

/// Results of the ticks.
#[derive(Debug, Clone, Copy)]
pub struct Report {
    /// Ticks since power-up.
    pub tick: u64,
    /// Phase of the machine.
    pub phase: Phase,
    /// Cause of the phase, if it was forced.
    pub cause: Cause,
    /// Finding of the wiring check, if that is the cause.
    pub finding: u16,
    /// Whether the amplifiers are enabled.
    pub amplifier_on: bool,
    /// The controller's status word.
    pub status: u32,
    /// Missed ticks.
    pub missed: u32,
    /// The last tick, by [`Self::tick`], with valid gauge readings; none if there was none.
    pub measured: Option<u64>,
    /// Counters and times.
    pub health: Counts,
}

/// Counters since power-up, and times in counts of [`Probes::hertz`].
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    /// Events since the host's last request.
    pub events: u32,
    /// Number of converter faults.
    pub converter_faults: u32,
    /// A bit for each kind of converter fault that occurred.
    pub faults: u32,
    /// Ticks with an invalid gauge.
    pub gauge_faults: u32,
    /// Ticks that ended after the start time of the next one.
    pub overruns: u32,
    /// Duration of a tick, the last and the longest; zeros before the first.
    pub tick: [u32; 2],
    /// Time from gauges to outputs, the last and the longest.
    pub output: [u32; 2],
    /// Largest delay of a tick's start.
    pub latest: u32,
}

impl Counts {
    /// As a message of the link. Values without a counter, or not timed yet, are none.
    pub(crate) fn health(&self, probes: &Probes) -> Health {
        let Self { events, converter_faults, faults, gauge_faults, overruns, tick, output, latest } = *self;
        let timed = |times: [u32; 2]| {
            let [_, longest] = times;
            if probes.hertz > 0 && longest > 0 { Some(times.map(u64::from)) } else { None }
        };
        let tick = timed(tick);
        let stack = (probes.stack)();
        let [_, reserved] = stack;
        Health {
            events,
            converter_faults,
            faults,
            gauge_faults,
            overruns: tick.map(|_| overruns),
            clock: probes.hertz,
            tick,
            output: timed(output),
            latest: tick.map(|_| u64::from(latest)),
            stack: if reserved > 0 { Some(stack) } else { None },
            reset_cause: probes.reset_cause,
        }
    }
}

impl Report {
    /// At power-up.
    pub const NONE: Self = Self {
        tick: 0,
        phase: Phase::Disarmed,
        cause: Cause::None,
        finding: 0,
        amplifier_on: false,
        status: 0,
        missed: 0,
        measured: None,
        health: Counts {
            events: 0,
            converter_faults: 0,
            faults: 0,
            gauge_faults: 0,
            overruns: 0,
            tick: [0; 2],
            output: [0; 2],
            latest: 0,
        },
    };

    /// As a message of the link.
    pub(crate) fn status(&self) -> Status {
        Status {
            tick: self.tick,
            phase: self.phase.word() as u8,
            cause: self.cause.word() as u8,
            finding: self.finding,
            amplifier_on: self.amplifier_on,
            status: self.status,
            events: self.health.events,
            late: self.missed,
            // A board whose ticks stop is reset by its watchdog.
            age: if self.tick > 0 { Some(0) } else { None },
            // The endpoint fills it in.
            link: Counters::NONE,
        }
    }

    /// A tick has run: its delay, its duration, and the time from its end to the next one; counts.
    pub const fn record_tick(&mut self, late: u32, duration: u32, period: u32) {
        let health = &mut self.health;
        if late > health.latest {
            health.latest = late;
        }
        last_and_longest(&mut health.tick, duration);
        if late.saturating_add(duration) > period {
            health.overruns = health.overruns.saturating_add(1);
        }
    }

    /// Time from sampling the gauges to writing the codes, counts.
    pub(crate) const fn record_output(&mut self, after: u32) {
        last_and_longest(&mut self.health.output, after);
    }

    /// A converter was not valid.
    pub(crate) const fn converter(&mut self, fault: Fault) {
        self.health.converter_faults = self.health.converter_faults.saturating_add(1);
        self.health.faults |= fault.bit();
    }

    /// Conditions of the supervisor.
    pub(crate) const fn conditions(&mut self, conditions: u32) {
        if conditions & OF_GAUGES != 0 {
            self.health.gauge_faults = self.health.gauge_faults.saturating_add(1);
        }
    }
}

const fn last_and_longest([last, longest]: &mut [u32; 2], now: u32) {
    *last = now;
    if now > *longest {
        *longest = now;
    }
}
