//! What the ticks have to say, and what they measure it with.

use controller::supervised::{Cause, Phase};
use specgen_hal::Fault;
use specgen_link::Health;
use specgen_runtime::supervisor::OF_GAUGES;

/// What times and stack are measured with.
#[derive(Debug, Clone, Copy)]
pub struct Probes {
    /// Counts in a second of the counter that ticks are timed with; 0 where nothing counts.
    pub hertz: u32,
    /// Most bytes of the stack seen in use, and bytes there are. Takes some µs: for the background.
    pub stack: fn() -> [u32; 2],
    /// Why the program began: bits of [`reset_cause`](specgen_link::reset_cause).
    pub reset_cause: u8,
}

impl Probes {
    /// Where nothing is measured: on a host.
    pub const NONE: Self = Self { hertz: 0, stack: || [0; 2], reset_cause: 0 };
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
    /// What the wiring check found, if that is why.
    pub finding: u16,
    /// Whether the amplifiers are enabled.
    pub amplifier_on: bool,
    /// The controller's status word.
    pub status: u32,
    /// Ticks that never came.
    pub missed: u32,
    /// The last tick, by [`Self::tick`], in which the gauges were read and believed; none if there was none.
    pub measured: Option<u64>,
    /// All else.
    pub health: Counts,
}

/// What is counted since power-up, and times in counts of [`Probes::hertz`].
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    /// Events since the host asked last.
    pub events: u32,
    /// Faults of converters, and a bit for each kind.
    pub converter_faults: u32,
    /// See [`Self::converter_faults`].
    pub faults: u32,
    /// Ticks with a gauge that was not believed.
    pub gauge_faults: u32,
    /// Ticks that ended after the next one was due.
    pub overruns: u32,
    /// A tick, the last and the longest; zeros until one was timed.
    pub tick: [u32; 2],
    /// From gauges to outputs, the same.
    pub output: [u32; 2],
    /// Largest delay of a tick's beginning.
    pub latest: u32,
}

impl Counts {
    /// As the link says it. What nothing counts, and what was not timed yet, is none.
    pub(crate) fn told(&self, probes: &Probes) -> Health {
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

    /// A tick has run: when it began after it was due, how long it took, and when after that the next one was due; counts.
    pub const fn took(&mut self, late: u32, duration: u32, period: u32) {
        let health = &mut self.health;
        if late > health.latest {
            health.latest = late;
        }
        last_and_longest(&mut health.tick, duration);
        if late.saturating_add(duration) > period {
            health.overruns = health.overruns.saturating_add(1);
        }
    }

    /// The codes were written so many counts after the gauges were sampled.
    pub(crate) const fn gave_out(&mut self, after: u32) {
        last_and_longest(&mut self.health.output, after);
    }

    /// A converter was not believed.
    pub(crate) const fn converter(&mut self, fault: Fault) {
        self.health.converter_faults = self.health.converter_faults.saturating_add(1);
        self.health.faults |= fault.bit();
    }

    /// The supervisor saw these conditions.
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
