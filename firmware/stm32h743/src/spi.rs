//! The SPI of the STM32H7: frames through its FIFO.

use embedded_hal::spi::{Mode, Phase, Polarity};
use specgen_stm32::burst::{Burst, SpiTimeout};
use stm32_metapac::spi::Spi;
use stm32_metapac::spi::regs::Cr1;
use stm32_metapac::spi::vals::{Cpha, Cpol, Fthlv, Master, Mbr, Ssiop};

/// Bytes on their way at once: those of the smallest FIFO (SPI4; SPI1 has twice as many).
const DEPTH: usize = 8;
/// Looks for each byte until it is given up: some ten times what 16 MHz take.
const LOOKS: usize = 100;

/// Its registers, set up.
pub struct Registers {
    spi: Spi,
    /// CR1 while it runs.
    running: Cr1,
    /// Of frames that are written, and of those whose answer counts.
    rates: [Mbr; 2],
}

impl Registers {
    /// Sets up an SPI that is as after reset, and has its clock and its pins: master, bytes, MSB first, SCLK the clock divided by
    /// a power of two: of frames that are written, of those whose answer counts.
    ///
    /// Transfers have no size (TSIZE 0): what is in the FIFO goes out, without a start for each. ES0392 (SPI: a master's transfer
    /// stalls if it is started within a cycle of SCLK after the end of the last one) names this as the way around it.
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
            // Its own select is SSI, which is low, and active when it is high: no mode fault. Its pins are driven while it is off.
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

    /// The same registers once more, for another chip select.
    #[must_use]
    pub const fn again(&self) -> Self {
        Self { spi: self.spi, running: self.running, rates: self.rates }
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

/// MBR of a divider.
fn rate(divider: u32) -> Mbr {
    Mbr::from_bits(divider.ilog2() as u8 - 1)
}

impl Burst for Registers {
    /// Written only while it is off; its pins are driven then, too.
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
