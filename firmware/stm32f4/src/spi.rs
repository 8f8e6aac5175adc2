//! The SPI of the STM32F4: a byte in its shift register, one before it and one behind it.

use embedded_hal::spi::{Mode, Phase, Polarity};
use specgen_stm32::burst::{Burst, SpiTimeout};
use stm32_metapac::spi::Spi;
use stm32_metapac::spi::vals::{Br, Cpha, Cpol, Mstr};

/// Looks for each byte until it is given up: some ten times what 11 MHz take.
const LOOKS: usize = 100;

/// Its registers, set up.
pub struct Registers {
    spi: Spi,
    /// Of frames that are written, and of those whose answer counts.
    rates: [Br; 2],
}

impl Registers {
    /// Sets up an SPI that is as after reset, and has its clock and its pins: master, bytes, MSB first, SCLK the clock divided by
    /// a power of two: of frames that are written, of those whose answer counts.
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
            // Its own select is not looked at: as if it were high.
            w.set_ssm(true);
            w.set_ssi(true);
            w.set_spe(true);
        });
        Self { spi, rates }
    }

    /// The same registers once more, for another chip select.
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
    /// Written only while nothing moves: the last bit was taken half a cycle before that.
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
        Err(SpiTimeout)
    }
}
