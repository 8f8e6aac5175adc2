//! The line that enables the amplifiers, as an output of TIM1 that the emergency contact takes away by itself: its break input
//! works without the core and without a clock (RM0433, RM0390: break function).
//!
//! | what | how it is |
//! | --- | --- |
//! | contact open: break input high | MOE falls at once, the line is driven low whatever the core does, or does not do any more |
//! | contact closed again | the line stays low: only a program that disabled it before, on purpose, may enable it |
//! | reset, or no supply | the pin floats, the pull-down at the amplifier decides |
//! | LOCK | polarity and enable of the break can no longer be written until reset |

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, OutputPin};
use stm32_metapac::TIM1;
use stm32_metapac::gpio::vals::{Ospeedr, Pupdr};

use crate::pins::Pin;

/// Alternate function of TIM1 on every pin that has it.
const FUNCTION: u8 = 1;
/// OCxM: forced active.
const ACTIVE: u32 = 0b101;
/// BDTR: LOCK level 1; OSSI, so that the line is driven while it is off; break enabled, active high; no automatic return (AOE).
const GUARDED: u32 = 1 << 8 | 1 << 10 | 1 << 12 | 1 << 13;
/// BDTR: main output.
const MOE: u32 = 1 << 15;
/// SR: the break input was active.
const BIF: u32 = 1 << 7;

/// The line. Off until it is set high.
#[derive(Debug)]
pub struct Enable(());

/// The emergency contact: closed to ground; open is stop. Pull-up in the part.
#[derive(Debug)]
pub struct Stop(());

/// Takes both pins: channel `CHANNEL` (1 to 4) of TIM1, low, and its break input. TIM1 has its clock, and is as after reset.
#[must_use]
pub fn guarded<const CHANNEL: usize>(line: Pin, contact: Pin) -> (Enable, Stop) {
    const { assert!(CHANNEL >= 1 && CHANNEL <= 4, "TIM1 has channels 1 to 4") };
    let place = CHANNEL - 1;
    contact.function(FUNCTION, Ospeedr::LOW_SPEED, Pupdr::PULL_UP);
    // OISx is 0 after reset: low while it is off.
    TIM1.ccmr_output(place / 2).modify(|w| w.0 |= ACTIVE << (8 * (place % 2) + 4));
    TIM1.ccer().modify(|w| w.0 |= 1 << (4 * place));
    TIM1.bdtr().write(|w| w.0 = GUARDED);
    line.function(FUNCTION, Ospeedr::LOW_SPEED, Pupdr::FLOATING);
    (Enable(()), Stop(()))
}

/// Line low, whatever state the program is in.
pub fn off() {
    TIM1.bdtr().write(|w| w.0 = GUARDED);
}

impl ErrorType for Enable {
    type Error = Infallible;
}

impl OutputPin for Enable {
    #[inline]
    fn set_low(&mut self) -> Result<(), Infallible> {
        off();
        // Does nothing while the contact is open.
        TIM1.sr().write(|w| w.0 = !BIF);
        Ok(())
    }

    /// Not after the contact was open, if only for a moment: then [`Stop`] shows it until the line was set low.
    #[inline]
    fn set_high(&mut self) -> Result<(), Infallible> {
        if TIM1.sr().read().0 & BIF == 0 {
            TIM1.bdtr().write(|w| w.0 = GUARDED | MOE);
        }
        Ok(())
    }
}

impl Stop {
    /// Whether the contact is open, or was since the line was set low last.
    #[inline]
    #[must_use]
    pub fn is_open(&self) -> bool {
        TIM1.sr().read().0 & BIF != 0
    }
}
