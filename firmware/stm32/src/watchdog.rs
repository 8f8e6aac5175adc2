//! The independent watchdog: resets the part unless it is fed. It has its own clock.

use stm32_metapac::iwdg::Iwdg;
use stm32_metapac::iwdg::vals::{Key, Pr};

/// LSI, Hz, which runs while the watchdog runs.
const CLOCK: u32 = 32_000;
/// Its prescaler, the smallest one.
const DIVIDER: u32 = 4;

/// The running watchdog, which cannot be stopped.
pub struct Watchdog(Iwdg);

impl Watchdog {
    /// Starts it with a timeout in µs, at most half a second.
    #[must_use]
    pub fn start(registers: Iwdg, time: u32) -> Self {
        let counts = time / DIVIDER * CLOCK / 1_000_000;
        registers.kr().write(|w| w.set_key(Key::ENABLE));
        registers.pr().write(|w| w.set_pr(Pr::from_bits(0)));
        registers.rlr().write(|w| w.set_rl(counts as u16 - 1));
        registers.kr().write(|w| w.set_key(Key::START));
        Self(registers)
    }

    /// Restarts the timeout.
    #[inline]
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.set_key(Key::RESET));
    }
}
