//! Seven AD7685 in a chain behind one CNV: six gauges and half of their reference.
//!
//! From the data sheet (AD7685 Rev. E, *Chain mode without busy indicator*):
//!
//! | what | as used here |
//! | --- | --- |
//! | chain | SDI of a part to SDO of the next; the last one's SDO to the microcontroller, the first one's SDI to ground |
//! | start | SCK low, SDI low at the rising edge of CNV: all parts sample at `begin`, and CNV stays high until they are read |
//! | conversion | 2.2 µs at most, then 1.8 µs of acquisition before the next |
//! | SPI | mode 0 (SCK idles low): bits change at falling edges, the first is out when the conversion ends |
//! | order | the part next to the microcontroller first, 16 bits each, MSB first, straight binary: 0 at 0 V |
//!
//! Gauges 0 to 5 come first; the part farthest away sees half of the reference of all. A part that is missing, or a frame that
//! is shifted by a bit, moves that code.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiBus;
use specgen_hal::{CHANNELS, Fault, Gauges};

/// Parts in the chain.
const PARTS: usize = CHANNELS + 1;
/// Longest conversion, ns.
const CONVERSION: u32 = 2_200;
/// Acquisition before the first conversion, ns.
const ACQUISITION: u32 = 1_800;
/// What the last part shows, and by how much it may differ: 2 %.
const HALF: u16 = 0x8000;
const TOLERANCE: u16 = 655;

/// The chain on its pins.
#[derive(Debug)]
pub struct Chain<SPI, START, DELAY> {
    spi: SPI,
    start: START,
    delay: DELAY,
}

impl<SPI: SpiBus, START: OutputPin, DELAY: DelayNs> Chain<SPI, START, DELAY> {
    /// Takes the pins. `start` is CNV of all parts.
    pub const fn new(spi: SPI, start: START, delay: DELAY) -> Self {
        Self { spi, start, delay }
    }

    fn frame(&mut self) -> Result<[u8; 2 * PARTS], Fault> {
        let mut frame = [0; 2 * PARTS];
        self.spi.transfer_in_place(&mut frame).map_err(|_| Fault::Bus)?;
        self.spi.flush().map_err(|_| Fault::Bus)?;
        Ok(frame)
    }
}

impl<SPI: SpiBus, START: OutputPin, DELAY: DelayNs> Gauges for Chain<SPI, START, DELAY> {
    const BITS: u32 = 16;

    fn start(&mut self) -> Result<(), Fault> {
        self.start.set_low().map_err(|_| Fault::Pin)?;
        self.delay.delay_ns(ACQUISITION);
        self.begin()?;
        self.read().map(|_| ())
    }

    fn begin(&mut self) -> Result<(), Fault> {
        self.start.set_high().map_err(|_| Fault::Pin)
    }

    fn read(&mut self) -> Result<[i32; CHANNELS], Fault> {
        self.delay.delay_ns(CONVERSION);
        let frame = self.frame();
        self.start.set_low().map_err(|_| Fault::Pin)?;
        let frame = frame?;
        if frame.iter().all(|&byte| byte == 0) || frame.iter().all(|&byte| byte == 0xff) {
            return Err(Fault::Blank);
        }
        let (pairs, _) = frame.as_chunks::<2>();
        let mut words = pairs.iter().map(|pair| u16::from_be_bytes(*pair));
        let codes = [(); CHANNELS].map(|()| words.next().map_or(0, i32::from));
        match words.next() {
            Some(half) if half.abs_diff(HALF) <= TOLERANCE => Ok(codes),
            _ => Err(Fault::Reference),
        }
    }
}
