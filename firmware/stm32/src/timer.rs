//! TIM2 as a free-running 32-bit counter whose first compare channel starts each tick: in the core by an interrupt, in the timer of
//! CONVST and LDAC ([`pulses`]) by its trigger output.

use core::num::NonZeroU32;

use cortex_m::peripheral::NVIC;
use specgen_board::{PERIOD_NANOSECONDS, Schedule};
use stm32_metapac::{Interrupt, TIM2};

use crate::pulses;

/// Counts per control period at a timer clock of so many Hz; none if the timer cannot count them.
#[must_use]
pub const fn period(hertz: u32) -> Option<NonZeroU32> {
    let counts = PERIOD_NANOSECONDS as u64 * hertz as u64 / 1_000_000_000;
    if counts < 1 << 31 { NonZeroU32::new(counts as u32) } else { None }
}

/// Starts the counter, which must have its clock and be in its reset state; the first interrupt comes one period later.
pub fn start(schedule: &mut Schedule) {
    TIM2.psc().write_value(0);
    TIM2.arr().write_value(u32::MAX);
    TIM2.cr2().modify(|w| w.set_mms(pulses::LEADS));
    arm(schedule.restart(now()));
    acknowledge();
    TIM2.dier().write(|w| w.set_ccie(0, true));
    TIM2.cr1().write(|w| w.set_cen(true));
}

/// The current count.
#[inline]
#[must_use]
pub fn now() -> u32 {
    TIM2.cnt().read()
}

/// Whether the next interrupt is more than so many counts away.
#[must_use]
pub fn is_calm<const COUNTS: u32>() -> bool {
    let left = TIM2.ccr(0).read().wrapping_sub(now());
    left > COUNTS && left < u32::MAX / 2
}

/// Sets the next interrupt to this count, or to now if it has passed.
#[inline]
pub fn arm(next: u32) {
    TIM2.ccr(0).write_value(next);
    // Passed meanwhile: the compare would match only after the counter wraps.
    if now().wrapping_sub(next) < u32::MAX / 2 {
        TIM2.egr().write(|w| w.set_ccg(0, true));
    }
}

/// After a tick that overran: the next interrupt comes one period from now. Interrupts that came due meanwhile are dropped, because
/// they would interfere with the timer of CONVST and LDAC.
pub fn restart(schedule: &mut Schedule) {
    arm(schedule.restart(now()));
    acknowledge();
    // Reading back the last write ensures that the line has fallen.
    let _ = TIM2.sr().read();
    NVIC::unpend(Interrupt::TIM2);
}

/// Clears the interrupt.
#[inline]
pub fn acknowledge() {
    // Writing 0 clears a flag, 1 leaves it.
    TIM2.sr().write(|w| {
        w.0 = u32::MAX;
        w.set_ccif(0, false);
    });
}
