//! The SPI of the STM32F4: a shift register with one byte of transmit and one of receive buffer.

use embedded_hal::spi::{Mode, Phase, Polarity};
use specgen_stm32::burst::{Burst, SpiTimeout};
use stm32_metapac::spi::Spi;
use stm32_metapac::spi::vals::{Br, Cpha, Cpol, Mstr};

/// Polls for each byte before the timeout: some ten times the duration at 11 MHz.
const LOOKS: usize = 100;

/// Its initialised registers.
pub struct Registers {
    spi: Spi,
    /// Rates for writing, and for frames whose answer is used.
    rates: [Br; 2],
}

impl Registers {
    /// Initialises an SPI in its reset state, with clock and pins: master, bytes, MSB first. SCLK is the clock divided by powers of
    /// two: for writing, and for frames whose answer is used.
    #[must_use]
    pub fn new(spi: Spi, mode: Mode, dividers: [u32; 2]) -> Self {
        let rates = dividers.map(rate);
        spi.cr2().modify(|w| w.set_ssoe(true));
        spi.cr1().modify(|w| {
            w.set_mstr(Mstr::MASTER);
            w.set_cpol(if mode.polarity == Polarity::IdleHigh { Cpol::IDLE_HIGH } else { Cpol::IDLE_LOW });
            w.set_cpha(if mode.phase == Phase::CaptureOnSecondTransition {
                Cpha::SECOND_EDGE
            } else {
                Cpha::FIRST_EDGE
            });
            w.set_br(rates[0]);
            // Its own select input is ignored, as if it were high.
            w.set_ssm(true);
            w.set_ssi(true);
            w.set_spe(true);
        });
        Self { spi, rates }
    }

    /// A second handle to the same registers, for another chip select.
    #[must_use]
    pub const fn again(&self) -> Self {
        Self { spi: self.spi, rates: self.rates }
    }
}

/// BR of a divider.
fn rate(divider: u32) -> Br {
    Br::from_bits(divider.ilog2() as u8 - 1)
}

impl Burst for Registers {
    /// Changes the rate only between transfers: the last bit was sampled half a cycle before.
    #[inline]
    fn pace(&mut self, answered: bool) {
        let [written, read] = self.rates;
        if written != read {
            let _ = (0..LOOKS).any(|_| !self.spi.sr().read().bsy());
            self.spi.cr1().modify(|w| w.set_br(if answered { read } else { written }));
        }
    }

    #[inline]
    fn exchange(
        &mut self,
        count: usize,
        mut send: impl FnMut(usize) -> u8,
        mut take: impl FnMut(usize, u8),
    ) -> Result<(), SpiTimeout> {
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
            // At most two bytes in flight, so that each received byte is read before the next one arrives.
            if sent < count && sent < taken + 2 && status.txe() {
                self.spi.dr().write(|w| w.set_dr(u16::from(send(sent))));
                sent += 1;
            }
        }
        if taken == count {
            return Ok(());
        }
        // Discard a late byte.
        let _ = self.spi.dr().read();
        Err(SpiTimeout)
    }
}
