//! The oscillator that all clocks come from: what drives the HSE pin, and if nothing does, the part's own (HSI). Both make the same
//! frequencies; HSI is less exact: docs/bring-up.md.
//!
//! When the clock at the pin fails later, the part's clock security system takes ENABLE away by the break of TIM1, as the
//! emergency contact does, goes on with HSI and interrupts (NMI), whose handler waits for the watchdog. The program that begins
//! then finds no clock at the pin.

use stm32_metapac::RCC;

/// Looks until nothing drives the pin: some ms of HSI. A clock is ready within 0.1 ms.
const LOOKS: u32 = 20_000;
/// CR: the clock security system.
const SECURED: u32 = 1 << 19;

/// Switches the pin's clock on, or off again if there is none; whether there is one.
pub fn external() -> bool {
    RCC.cr().modify(|w| w.set_hsebyp(true));
    RCC.cr().modify(|w| w.set_hseon(true));
    let there = (0..LOOKS).any(|_| RCC.cr().read().hserdy());
    if !there {
        RCC.cr().modify(|w| w.set_hseon(false));
    }
    there
}

/// From here on the pin's clock, if it is used, is watched.
pub fn secure() {
    if RCC.cr().read().hserdy() {
        RCC.cr().modify(|w| w.0 |= SECURED);
    }
}
