//! The SPI of the STM32H7: frames through its FIFO.

use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::spi::Spi as Pac;
use embassy_stm32::pac::spi::regs::Cr1;
use embassy_stm32::spi::Spi;
use embassy_stm32::spi::mode::Master;
use specgen_stm32::burst::{Burst, Stuck};

/// Bytes on their way at once: those of the smallest FIFO (SPI4; SPI1 has twice as many).
const DEPTH: usize = 8;
/// Looks for each byte until it is given up: some ten times what 16 MHz take.
const LOOKS: usize = 100;

/// Its registers, set up.
pub struct Registers {
    spi: Pac,
    /// CR1 while it runs.
    running: Cr1,
}

impl Registers {
    /// Takes an SPI that the HAL has set up, with its registers. Its pins and its clock stay as they are.
    ///
    /// Transfers have no size (TSIZE 0): what is in the FIFO goes out, without a start for each. ES0392 (SPI: a master's transfer
    /// stalls if it is started within a cycle of SCLK after the end of the last one) names this as the way around it.
    #[must_use]
    pub fn new(driver: Spi<'static, Blocking, Master>, spi: Pac) -> Self {
        core::mem::forget(driver);
        spi.cr1().modify(|w| w.set_spe(false));
        spi.cr2().write(|w| w.set_tsize(0));
        spi.cfg1().modify(|w| {
            w.set_dsize(7);
            w.set_fthlv(embassy_stm32::pac::spi::vals::Fthlv::ONE_FRAME);
        });
        let mut running = spi.cr1().read();
        running.set_spe(true);
        running.set_cstart(true);
        let registers = Self { spi, running };
        registers.start();
        registers
    }

    /// The same registers once more, for another chip select.
    #[must_use]
    pub const fn again(&self) -> Self {
        Self { spi: self.spi, running: self.running }
    }

    /// With empty FIFOs.
    fn start(&self) {
        self.spi.cr1().modify(|w| w.set_spe(false));
        let mut enabled = self.running;
        enabled.set_cstart(false);
        self.spi.cr1().write_value(enabled);
        self.spi.cr1().write_value(self.running);
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
        let mut sent = 0;
        while sent < count && sent < DEPTH {
            self.spi.txdr8().write_value(send(sent));
            sent += 1;
        }
        let mut taken = 0;
        for _ in 0..count * LOOKS {
            if taken == count {
                return Ok(());
            }
            if self.spi.sr().read().rxp() {
                take(taken, self.spi.rxdr8().read());
                taken += 1;
                if sent < count {
                    self.spi.txdr8().write_value(send(sent));
                    sent += 1;
                }
            }
        }
        if taken == count {
            return Ok(());
        }
        self.start();
        Err(Stuck)
    }
}
