//! The independent watchdog: a reset unless it is fed, by a clock of its own.

use stm32_metapac::iwdg::Iwdg;
use stm32_metapac::iwdg::vals::{Key, Pr};

/// LSI, Hz, which runs as long as the watchdog does.
const CLOCK: u32 = 32_000;
/// Of its prescaler: the smallest.
const DIVIDER: u32 = 4;

/// It runs, and cannot be stopped.
pub struct Watchdog(Iwdg);

impl Watchdog {
    /// Starts it with a time in µs, of half a second at most.
    #[must_use]
    pub fn start(registers: Iwdg, time: u32) -> Self {
        let counts = time / DIVIDER * CLOCK / 1_000_000;
        registers.kr().write(|w| w.set_key(Key::ENABLE));
        registers.pr().write(|w| w.set_pr(Pr::from_bits(0)));
        registers.rlr().write(|w| w.set_rl(counts as u16 - 1));
        registers.kr().write(|w| w.set_key(Key::START));
        Self(registers)
    }

    /// The time begins anew.
    #[inline]
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.set_key(Key::RESET));
    }
}
