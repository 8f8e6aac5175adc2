//! What happens where nothing should: amplifiers off, then the watchdog resets the part.

#![allow(unsafe_code)] // Handlers of exceptions.

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};

use crate::pins;

/// Amplifiers off and nothing more: the watchdog is fed by the tick alone, and resets the part within 20 ms. Reset leaves
/// the enable line to its pull-down.
pub fn stop() -> ! {
    cortex_m::interrupt::disable();
    loop {
        pins::amplifiers_off();
    }
}

/// Initialisation and the drivers of the HAL have paths that end here; the tick has none, see docs/bring-up.md.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    stop()
}

#[exception]
// SAFETY: called by the vector table alone; does not return.
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop()
}

#[exception]
// SAFETY: called by the vector table alone; does not return.
unsafe fn DefaultHandler(_: i16) -> ! {
    stop()
}
