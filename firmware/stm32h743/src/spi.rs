//! The SPI of the STM32H7: frames through its FIFO.

use embedded_hal::spi::{Mode, Phase, Polarity};
use specgen_stm32::burst::{Burst, SpiTimeout};
use stm32_metapac::spi::Spi;
use stm32_metapac::spi::regs::Cr1;
use stm32_metapac::spi::vals::{Cpha, Cpol, Fthlv, Master, Mbr, Ssiop};

/// Bytes in flight at once: the depth of the smallest FIFO (SPI4; SPI1 has twice as much).
const DEPTH: usize = 8;
/// Polls for each byte before the timeout: some ten times the duration at 16 MHz.
const LOOKS: usize = 100;

/// Its initialised registers.
pub struct Registers {
    spi: Spi,
    /// CR1 while it runs.
    running: Cr1,
    /// Rates for writing, and for frames whose answer is used.
    rates: [Mbr; 2],
}

impl Registers {
    /// Initialises an SPI in its reset state, with clock and pins: master, bytes, MSB first. SCLK is the clock divided by powers of
    /// two: for writing, and for frames whose answer is used.
    ///
    /// Transfers have no size (TSIZE 0): the FIFO is sent without a start for each transfer. This is the workaround of ES0392 for
    /// transfers that stall if they are started within an SCLK cycle after the end of the last one.
    #[must_use]
    pub fn new(spi: Spi, mode: Mode, dividers: [u32; 2]) -> Self {
        let rates = dividers.map(rate);
        spi.cfg2().modify(|w| {
            w.set_master(Master::MASTER);
            w.set_cpol(if mode.polarity == Polarity::IdleHigh { Cpol::IDLE_HIGH } else { Cpol::IDLE_LOW });
            w.set_cpha(if mode.phase == Phase::CaptureOnSecondTransition {
                Cpha::SECOND_EDGE
            } else {
                Cpha::FIRST_EDGE
            });
            // Its own select is SSI, which is low and active high, so there is no mode fault. Its pins are driven while it is disabled.
            w.set_ssm(true);
            w.set_ssoe(true);
            w.set_ssiop(Ssiop::ACTIVE_HIGH);
            w.set_afcntr(true);
        });
        spi.cr2().write(|w| w.set_tsize(0));
        spi.cfg1().modify(|w| {
            w.set_mbr(rates[0]);
            w.set_dsize(7);
            w.set_fthlv(Fthlv::ONE_FRAME);
        });
        let mut running = spi.cr1().read();
        running.set_spe(true);
        running.set_cstart(true);
        let registers = Self { spi, running, rates };
        registers.start();
        registers
    }

    /// A second handle to the same registers, for another chip select.
    #[must_use]
    pub const fn again(&self) -> Self {
        Self { spi: self.spi, running: self.running, rates: self.rates }
    }

    /// Starts with empty FIFOs.
    fn start(&self) {
        self.spi.cr1().modify(|w| w.set_spe(false));
        let mut enabled = self.running;
        enabled.set_cstart(false);
        self.spi.cr1().write_value(enabled);
        self.spi.cr1().write_value(self.running);
    }
}

/// MBR of a divider.
fn rate(divider: u32) -> Mbr {
    Mbr::from_bits(divider.ilog2() as u8 - 1)
}

impl Burst for Registers {
    /// Changes the rate only while the SPI is disabled; its pins are driven then, too.
    #[inline]
    fn pace(&mut self, answered: bool) {
        let [written, read] = self.rates;
        if written != read {
            self.spi.cr1().modify(|w| w.set_spe(false));
            self.spi.cfg1().modify(|w| w.set_mbr(if answered { read } else { written }));
            self.start();
        }
    }

    #[inline]
    fn exchange(
        &mut self,
        count: usize,
        mut send: impl FnMut(usize) -> u8,
        mut take: impl FnMut(usize, u8),
    ) -> Result<(), SpiTimeout> {
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
        Err(SpiTimeout)
    }
}
