//! The supply of the microcontroller: switches the amplifiers off before the voltage is too low for correct operation.
//!
//! The part resets itself at about 1.7 V. A higher threshold (brown-out level 3: 2.7 V) is set in the option bytes, which are in flash
//! and which programs should not write: `docs/bring-up.md` shows how to set them once. Even before that, the voltage detector
//! interrupts at 2.85 V (F446: 2.8 V).

#![allow(unsafe_code)] // An interrupt is enabled.

use cortex_m::peripheral::NVIC;
use stm32_metapac::{EXTI, Interrupt, PWR};

/// PLS: the second-highest threshold.
const THRESHOLD: u8 = 6;
/// EXTI line of the detector.
const LINE: usize = 16;

/// Monitors the supply from now on: `interrupt`, that of the detector, has the highest priority, above the tick. False if the
/// supply is already too low.
#[must_use]
pub fn watch(interrupt: Interrupt) -> bool {
    PWR.cr1().modify(|w| {
        w.set_pls(THRESHOLD);
        w.set_pvde(true);
    });
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    // Its priority after reset is the highest.
    // SAFETY: its handler stops the program at any point.
    unsafe { NVIC::unmask(interrupt) };
    !PWR.csr1().read().pvdo()
}
