//! The supply of the microcontroller: amplifiers off before it is too low to compute by.
//!
//! The part resets itself at 1.7 V or so. What resets it sooner (brown-out level 3: 2.7 V) stands in the option bytes, which are in
//! flash and which no program writes lightly: `docs/bring-up.md` says how they are set once. Until then, and before it comes to
//! that, the voltage detector interrupts at 2.85 V (F446: 2.8 V).

#![allow(unsafe_code)] // An interrupt is enabled.

use cortex_m::peripheral::NVIC;
use stm32_metapac::{EXTI, Interrupt, PWR};

/// PLS: the last but one threshold.
const THRESHOLD: u8 = 6;
/// Of the EXTI that the detector is on.
const LINE: usize = 16;

/// Watches the supply from here on: `interrupt`, that of the detector, comes at the highest priority when it is too low, above the tick.
/// False if it is already.
#[must_use]
pub fn watch(interrupt: Interrupt) -> bool {
    PWR.cr1().modify(|w| {
        w.set_pls(THRESHOLD);
        w.set_pvde(true);
    });
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    // Its priority is that of reset, the highest.
    // SAFETY: its handler stops the program, whatever it was about to do.
    unsafe { NVIC::unmask(interrupt) };
    !PWR.csr1().read().pvdo()
}
