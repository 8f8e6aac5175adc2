//! Debouncing: how long a condition must last before it becomes a cause.

use super::kinds::Cause;
use super::supervision::{Supervision, TIMED, TIMERS};

/// Increment of a count in a tick with a wrong sample or a failed converter. Every other tick decrements it by 1, so
/// more than one such tick in five leads to a fault.
pub const WRONG: u32 = 4;

/// Causes that act without debouncing.
const AT_ONCE: u32 = Cause::LinkLost.bit()
    | Cause::Integrity.bit()
    | Cause::EmergencyStop.bit()
    | Cause::Stalled.bit()
    | Cause::AmplifierFault.bit()
    | Cause::Workspace.bit();

/// The bit of the condition that a cause waits for: its own, or that of the preceding cause.
const fn condition(cause: Cause) -> u32 {
    match cause {
        Cause::HostGone => Cause::LinkLost.bit(),
        own => own.bit(),
    }
}

crate::state! { |words|
    /// Leaky counters. An intermittent condition is counted if its share of the ticks is above 1 in 1 + its weight.
    #[derive(PartialEq, Eq)]
    pub struct Debounce {
        /// One for each of [`TIMED`].
        pub counts: [u32; TIMERS] = [0; TIMERS], tallies;
    }
}

impl Debounce {
    /// Counts the conditions that are `present` (bits of causes) and returns the causes that have lasted long enough.
    ///
    /// Usually no condition is present or counted. `busy` is the result of the last call: whether any count is above
    /// zero.
    #[inline]
    pub fn count<T>(&mut self, supervision: &Supervision<T>, present: u32, busy: &mut bool) -> u32 {
        if present == 0 && !*busy {
            return 0;
        }
        self.count_slowly(supervision, present, busy)
    }

    #[cold]
    #[inline(never)]
    fn count_slowly<T>(&mut self, supervision: &Supervision<T>, present: u32, busy: &mut bool) -> u32 {
        let mut lasted = present & AT_ONCE;
        let mut any = 0;
        for (index, (cause, count)) in TIMED.iter().zip(&mut self.counts).enumerate() {
            let timeout = supervision.timeout[index];
            if present & condition(*cause) == 0 {
                *count = count.saturating_sub(1);
            } else {
                rise(count, supervision.weight[index], timeout);
                if *count >= timeout {
                    lasted |= cause.bit();
                }
            }
            any |= *count;
        }
        *busy = any != 0;
        lasted
    }
}

/// Adds to a leaky counter. It saturates at its limit, so that its decay time is bounded.
#[inline(always)]
pub(super) fn rise(count: &mut u32, by: u32, limit: u32) {
    let sum = count.saturating_add(by);
    *count = if sum > limit { limit } else { sum };
}
