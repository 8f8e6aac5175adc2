//! Schedule of the ticks, by a free-running counter that wraps around.

use core::num::NonZeroU32;

/// A tick that is due now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DueTick {
    /// Counts between its start time and its actual start.
    pub late: u32,
    /// Missed ticks between the last and this one.
    pub missed: u32,
    /// Counter value of the next tick, for the compare register.
    pub next: u32,
}

/// Ticks at a fixed period of a counter of 32 bits. A tick that begins late does not move the later ones.
#[derive(Debug, Clone, Copy)]
pub struct Schedule {
    period: NonZeroU32,
    due: u32,
}

impl Schedule {
    /// The first tick is due one period after `now`. `period` is in counts, less than 2³¹.
    #[must_use]
    pub const fn new(period: NonZeroU32, now: u32) -> Self {
        Self { period, due: now.wrapping_add(period.get()) }
    }

    /// Counter value of the next tick.
    #[must_use]
    pub const fn next(&self) -> u32 {
        self.due
    }

    /// Counts of a period.
    #[must_use]
    pub const fn period(&self) -> u32 {
        self.period.get()
    }

    /// The tick starts at counter value `now`.
    pub const fn begin(&mut self, now: u32) -> DueTick {
        // A tick before its time, by a spurious interrupt, counts as on time. A difference above a period means a long
        // stop.
        let early = self.due.wrapping_sub(now) <= self.period.get();
        let late = if early { 0 } else { now.wrapping_sub(self.due) };
        // Divided by a number that is not zero.
        let missed = late / self.period.get();
        self.due = self.due.wrapping_add(self.period.get().wrapping_mul(missed)).wrapping_add(self.period.get());
        DueTick { late: late - missed * self.period.get(), missed, next: self.due }
    }

    /// Restarts the schedule at `now`, without missed ticks: for a tick that had to take longer than a period.
    pub const fn restart(&mut self, now: u32) -> u32 {
        self.due = now.wrapping_add(self.period.get());
        self.due
    }
}
