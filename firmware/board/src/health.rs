//! Whether the watchdog may be fed.

use controller::limits::CODES;
use controller::supervision::SUPERVISION;

use crate::words::PERIOD_NANOSECONDS;

/// Ticks in a second.
const SECOND: u32 = 1_000_000_000 / PERIOD_NANOSECONDS + 1;
/// Ticks without a sign of the background after which it is dead: one second. Nobody can ask for anything any more, so the tick
/// ramps down; once the amplifiers are off the watchdog is starved.
pub const BACKGROUND_SILENCE: u32 = SECOND;
/// Ticks after which it is starved even with the amplifiers on: a second to come to rest, and a ramp over all codes.
pub const RAMPED_DOWN: u32 = {
    let steps = CODES[1].abs_diff(CODES[0]) / SUPERVISION.ramp_step.unsigned_abs() + 1;
    BACKGROUND_SILENCE.saturating_add(SECOND).saturating_add(steps.saturating_mul(SUPERVISION.ramp_every))
};
/// Ticks in a row with missed ones before them, after which the watchdog is starved: the controller is too slow for good.
pub const MISSES_IN_A_ROW: u32 = 64;

/// Counts what is wrong for long.
#[derive(Debug, Clone, Copy, Default)]
pub struct Health {
    beat: u32,
    silent: u32,
    misses: u32,
}

impl Health {
    /// Nothing wrong yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { beat: 0, silent: 0, misses: 0 }
    }

    /// A tick has run to its end. `beat` is what the background counts up; `missed` are the ticks lost before this one.
    /// Whether the watchdog is to be fed.
    pub const fn tick(&mut self, beat: u32, missed: u32, amplifier_on: bool) -> bool {
        self.silent = if beat == self.beat { self.silent.saturating_add(1) } else { 0 };
        self.beat = beat;
        self.misses = if missed > 0 { self.misses.saturating_add(1) } else { 0 };
        let silence = if amplifier_on { RAMPED_DOWN } else { BACKGROUND_SILENCE };
        self.silent < silence && self.misses < MISSES_IN_A_ROW
    }

    /// Whether the background is dead: the next tick is to ramp down.
    #[must_use]
    pub const fn is_orphaned(&self) -> bool {
        self.silent >= BACKGROUND_SILENCE
    }
}
