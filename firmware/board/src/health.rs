//! Whether the watchdog may be fed.

/// Ticks without a sign of the background after which the watchdog is starved, once the amplifiers are off: one second at
/// 10 kHz. While they are on the supervisor has the link's silence to go by, and brings the platform to rest first.
pub const BACKGROUND_SILENCE: u32 = 10_000;
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
        let background = amplifier_on || self.silent < BACKGROUND_SILENCE;
        background && self.misses < MISSES_IN_A_ROW
    }
}
