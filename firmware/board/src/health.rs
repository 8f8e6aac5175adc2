//! Decides whether the watchdog is fed.

use controller::limits::CODES;
use controller::supervision::SUPERVISION;

use crate::words::PERIOD_NANOSECONDS;

/// Ticks in a second.
const SECOND: u32 = 1_000_000_000 / PERIOD_NANOSECONDS + 1;
/// Ticks without a sign of the background after which it counts as dead: one second. The host then has no access, so
/// the tick ramps down. Once the amplifiers are off, the watchdog is no longer fed.
pub const BACKGROUND_SILENCE: u32 = SECOND;
/// Ticks after which it is not fed even with the amplifiers on: a second to stop, plus a ramp over all codes.
pub const RAMPED_DOWN: u32 = {
    let steps = CODES[1].abs_diff(CODES[0]) / SUPERVISION.ramp_step.unsigned_abs() + 1;
    BACKGROUND_SILENCE.saturating_add(SECOND).saturating_add(steps.saturating_mul(SUPERVISION.ramp_every))
};
/// Consecutive ticks with missed ticks before them after which the watchdog is not fed: the controller is permanently
/// too slow.
pub const MISSES_IN_A_ROW: u32 = 64;

/// Counters of persistent faults.
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

    /// End of a tick. `beat` is the background's counter; `missed` are the ticks missed before this one. Returns
    /// whether to feed the watchdog.
    pub const fn tick(&mut self, beat: u32, missed: u32, amplifier_on: bool) -> bool {
        self.silent = if beat == self.beat { self.silent.saturating_add(1) } else { 0 };
        self.beat = beat;
        self.misses = if missed > 0 { self.misses.saturating_add(1) } else { 0 };
        let silence = if amplifier_on { RAMPED_DOWN } else { BACKGROUND_SILENCE };
        self.silent < silence && self.misses < MISSES_IN_A_ROW
    }

    /// Whether the background is dead: the next tick must ramp down.
    #[must_use]
    pub const fn is_orphaned(&self) -> bool {
        self.silent >= BACKGROUND_SILENCE
    }
}
