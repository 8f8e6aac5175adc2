//! The line that enables the amplifiers: an output of TIM1 that the emergency contact switches off in hardware. The break input
//! works without the core and without a clock (RM0433, RM0390: break function).
//!
//! | condition | effect |
//! | --- | --- |
//! | contact open: break input high | MOE falls immediately and the line is driven low, independently of the core |
//! | contact closed again | the line stays low until the program disables it explicitly and enables it again |
//! | reset, or no supply | the pin floats, and the pull-down at the amplifier disables it |
//! | LOCK | polarity and enable of the break cannot be changed until reset |

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, OutputPin};
use stm32_metapac::TIM1;
use stm32_metapac::gpio::vals::{Ospeedr, Pupdr};

use crate::pins::Pin;

/// Alternate function of TIM1 on every pin that has it.
const FUNCTION: u8 = 1;
/// OCxM: forced active.
const ACTIVE: u32 = 0b101;
/// BDTR: LOCK level 1; OSSI, so that the line is driven while it is off; break enabled, active high; no automatic output enable (AOE).
const GUARDED: u32 = 1 << 8 | 1 << 10 | 1 << 12 | 1 << 13;
/// BDTR: main output.
const MOE: u32 = 1 << 15;
/// SR: the break input was active.
const BIF: u32 = 1 << 7;

/// The line. Off until it is set high.
#[derive(Debug)]
pub struct Enable(());

/// The emergency contact: closed to ground; open means stop. Internal pull-up.
#[derive(Debug)]
pub struct Stop(());

/// Configures both pins: channel `CHANNEL` (1 to 4) of TIM1, low, and its break input. TIM1 must have its clock and be in its reset state.
#[must_use]
pub fn guarded<const CHANNEL: usize>(line: Pin, contact: Pin) -> (Enable, Stop) {
    const { assert!(CHANNEL >= 1 && CHANNEL <= 4, "TIM1 has channels 1 to 4") };
    let place = CHANNEL - 1;
    contact.function(FUNCTION, Ospeedr::LOW_SPEED, Pupdr::PULL_UP);
    // OISx is 0 after reset: low in the off state.
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
        // Has no effect while the contact is open.
        TIM1.sr().write(|w| w.0 = !BIF);
        Ok(())
    }

    /// Has no effect after the contact was open, however briefly: [`Stop`] then reports it until the line is set low.
    #[inline]
    fn set_high(&mut self) -> Result<(), Infallible> {
        if TIM1.sr().read().0 & BIF == 0 {
            TIM1.bdtr().write(|w| w.0 = GUARDED | MOE);
        }
        Ok(())
    }
}

impl Stop {
    /// Whether the contact is open, or has been open since the line was last set low.
    #[inline]
    #[must_use]
    pub fn is_open(&self) -> bool {
        TIM1.sr().read().0 & BIF != 0
    }
}
