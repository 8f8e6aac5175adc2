//! The SPI of the STM32F4: a byte in its shift register, one before it and one behind it.

use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::spi::Spi as Pac;
use embassy_stm32::spi::Spi;
use embassy_stm32::spi::mode::Master;
use specgen_stm32::burst::{Burst, Stuck};

/// Looks for each byte until it is given up: some ten times what 11 MHz take.
const LOOKS: usize = 100;

/// Its registers, set up.
pub struct Registers {
    spi: Pac,
}

impl Registers {
    /// Takes an SPI that the HAL has set up for bytes, with its registers. Its pins and its clock stay as they are.
    #[must_use]
    pub fn new(driver: Spi<'static, Blocking, Master>, spi: Pac) -> Self {
        core::mem::forget(driver);
        spi.cr1().modify(|w| w.set_spe(true));
        Self { spi }
    }

    /// The same registers once more, for another chip select.
    #[must_use]
    pub const fn again(&self) -> Self {
        Self { spi: self.spi }
    }
}

impl Burst for Registers {
    #[inline]
    fn exchange(
        &mut self,
        count: usize,
        mut send: impl FnMut(usize) -> u8,
        mut take: impl FnMut(usize, u8),
    ) -> Result<(), Stuck> {
        let (mut sent, mut taken) = (0, 0);
        for _ in 0..count * LOOKS {
            if taken == count {
                return Ok(());
            }
            let status = self.spi.sr().read();
            if status.rxne() {
                take(taken, self.spi.dr().read().dr() as u8);
                taken += 1;
            }
            // Two on their way at most, so that what came is taken before the next one is there.
            if sent < count && sent < taken + 2 && status.txe() {
                self.spi.dr().write(|w| w.set_dr(u16::from(send(sent))));
                sent += 1;
            }
        }
        if taken == count {
            return Ok(());
        }
        // What came late is of no use to the next frame.
        let _ = self.spi.dr().read();
        Err(Stuck)
    }
}
