//! The source of all clocks: the clock at the HSE pin or, without one, the internal oscillator (HSI). Both give the same frequencies;
//! HSI is less accurate: docs/bring-up.md.
//!
//! If the clock at the pin fails later, the clock security system switches ENABLE off by the break of TIM1, as the emergency
//! contact does, and continues on HSI with an interrupt (NMI), whose handler waits for the watchdog. After that reset the program
//! finds no clock at the pin.

use stm32_metapac::RCC;

/// Polls until the pin counts as undriven: some ms of HSI. A clock is ready within 0.1 ms.
const LOOKS: u32 = 20_000;
/// CR: the clock security system.
const SECURED: u32 = 1 << 19;

/// Enables the clock at the pin, and disables it again if there is none. Returns whether there is one.
pub fn external() -> bool {
    RCC.cr().modify(|w| w.set_hsebyp(true));
    RCC.cr().modify(|w| w.set_hseon(true));
    let there = (0..LOOKS).any(|_| RCC.cr().read().hserdy());
    if !there {
        RCC.cr().modify(|w| w.set_hseon(false));
    }
    there
}

/// Monitors the clock at the pin from now on, if it is used.
pub fn secure() {
    if RCC.cr().read().hserdy() {
        RCC.cr().modify(|w| w.0 |= SECURED);
    }
}
