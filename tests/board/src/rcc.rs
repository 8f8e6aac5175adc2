//! Clocks: the registers from which each clock follows. What is switched on is ready at once.

use crate::part::{Family, HSE};
use crate::store::Store;

/// Frequencies, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clocks {
    pub core: u64,
    /// Of TIM2 and the timer of CONVST and LDAC.
    pub timer: u64,
    /// Of the SPI of the ADC, and that of the DACs.
    pub spi: [u64; 2],
    /// Of the link's USART.
    pub usart: u64,
}

/// What the registers give, with `rcc` as their base.
pub fn clocks(family: Family, rcc: u32, registers: &Store) -> Clocks {
    let register = |offset: u32| registers.word(rcc + offset);
    match family {
        Family::H7 => {
            let divider = |offset: u32, shift: u32| match register(offset) >> shift & 7 {
                code @ 4..=7 => 2 << (code - 4),
                _ => 1,
            };
            let hsi = 64_000_000 >> (register(0) >> 3 & 3);
            let source = if register(0x28) & 3 == 2 { HSE } else { hsi };
            // Oscillator of a PLL, and what it gives by the divider at this place.
            let oscillator = |number: u32| {
                let times = u64::from((register(0x30 + 8 * number) & 0x1ff) + 1);
                source * times / u64::from((register(0x28) >> (4 + 8 * number) & 0x3f).max(1))
            };
            let output = |number: u32, place: u32| {
                oscillator(number) / u64::from((register(0x30 + 8 * number) >> place & 0x7f) + 1)
            };
            let core = match register(0x10) & 7 {
                3 => output(0, 9),
                2 => HSE,
                _ => hsi,
            };
            let bus = match register(0x18) & 0xf {
                code @ 8..=11 => core >> (code - 7),
                _ => core,
            };
            let first = bus / divider(0x1c, 4);
            let timer = if divider(0x1c, 4) == 1 { first } else { 2 * first };
            let chosen = register(0x50);
            let adc = if chosen >> 12 & 7 == 1 { output(1, 9) } else { output(0, 16) };
            let dac = if chosen >> 16 & 7 == 1 { output(1, 16) } else { bus / divider(0x1c, 8) };
            Clocks { core, timer, spi: [adc, dac], usart: first }
        }
        Family::F4 => {
            let divider = |shift: u32| match register(8) >> shift & 7 {
                code @ 4..=7 => 2 << (code - 4),
                _ => 1,
            };
            let pll = register(4);
            let source = if pll >> 22 & 1 == 1 { HSE } else { 16_000_000 };
            let oscillator = source / u64::from((pll & 0x3f).max(1)) * u64::from(pll >> 6 & 0x1ff);
            let core = match register(8) & 3 {
                2 => oscillator / u64::from(2 * ((pll >> 16 & 3) + 1)),
                1 => HSE,
                _ => 16_000_000,
            };
            let (first, second) = (core / divider(10), core / divider(13));
            let timer = if divider(10) == 1 { first } else { 2 * first };
            Clocks { core, timer, spi: [second, first], usart: first }
        }
    }
}

/// PLLCKSELR of an H7.
pub const SOURCE: u32 = 0x28;

/// CR: there is a clock at the pin.
pub const HSE_READY: u32 = 1 << 17;

/// Whether a write of [`SOURCE`] is not allowed, with CR as it stands: of the source while a PLL runs, or of the divider of one that
/// does.
pub fn refused(family: Family, control: u32, before: u32, after: u32) -> bool {
    let runs = [0, 1, 2].map(|number| control >> (24 + 2 * number) & 1 == 1);
    let changed = before ^ after;
    let divider = |number: usize| changed >> (4 + 8 * number) & 0x3f != 0;
    family == Family::H7
        && (changed & 3 != 0 && runs.contains(&true) || (0..3).any(|number| runs[number] && divider(number)))
}

/// A register of RCC as it reads: each ready bit is its switch, and the clock in use the one that was chosen.
pub fn read(family: Family, offset: u32, word: u32) -> u32 {
    match (family, offset) {
        (Family::H7, 0) => {
            let ready = (word & 1) << 2 | (word >> 7 & 1) << 8 | (word >> 12 & 1) << 13 | (word >> 16 & 1) << 17;
            word & !0x2a02_2104 | ready | 1 << 5 | (word & 0x1500_0000) << 1
        }
        (Family::H7, 0x10) => word & !0x38 | (word & 7) << 3,
        (Family::H7, 0x70 | 0x74) | (Family::F4, 0x70 | 0x74) => word & !2 | (word & 1) << 1,
        (Family::F4, 0) => {
            word & !0x2a02_0002 | (word & 1) << 1 | (word & 0x0001_0000) << 1 | (word & 0x1500_0000) << 1
        }
        (Family::F4, 8) => word & !0xc | (word & 3) << 2,
        _ => word,
    }
}

/// A register of PWR as it reads: every voltage is reached at once.
pub fn power(family: Family, offset: u32, word: u32) -> u32 {
    match (family, offset) {
        (Family::H7, 4) => word | 1 << 13,
        (Family::H7, 0x18) => word | 1 << 13,
        (Family::F4, 4) => word | 1 << 14 | 3 << 16,
        _ => word,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_is_locked_by_any_pll_and_a_divider_by_its_own() {
        let refused = |control, before, after| refused(Family::H7, control, before, after);
        assert!(refused(1 << 24, 2, 0));
        assert!(refused(1 << 26, 0x1010, 0x2010));
        assert!(!refused(1 << 24, 0x0012, 0x1012), "the divider of PLL2 while PLL1 runs");
        assert!(!refused(0, 0, 0x12));
    }
}
