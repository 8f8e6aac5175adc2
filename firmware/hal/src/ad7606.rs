//! AD7606, AD7606B (16 bits), AD7608, AD7606C-18 (18 bits): eight channels sampled simultaneously, read over SPI.
//!
//! From the data sheets (AD7606 Rev. F, AD7608 Rev. B); hardware mode, one serial data line.
//!
//! | what | as used here |
//! | --- | --- |
//! | interface | PAR/SER/BYTE SEL high, DB15/BYTE SEL low: serial; all channels on DOUTA, V1 first |
//! | SPI | mode 2 (SCLK idles high): the falling edge of CS outputs the MSB, that of SCLK samples it, the rising edge outputs the next bit |
//! | SCLK | at most 23.5 MHz at VDRIVE above 4.75 V, 17 MHz at 3.3 V: 16.7 MHz or less is used |
//! | start | CONVST A and B together: low for 25 ns or more, then the rising edge samples all channels |
//! | BUSY | high within 45 ns of that edge, low when all are converted: 4.2 µs at most (AD7608: 4.2 µs) without oversampling |
//! | frame | BUSY is high after the edge of this tick, falls once, and stays low until the last bit is read |
//! | code | two's complement of 16 or 18 bits, MSB first, no gap between the channels |
//! | RANGE | low ±5 V, high ±10 V on all channels |
//! | OS0–2 | low: no oversampling |
//! | RESET | high for 50 ns (AD7606B: 3 µs) after power-up, then 300 µs until the first start |
//!
//! V1 to V6 are the gauges. V8 is connected to the 2.5 V reference of the DACs: it detects within a tick a part that answers with
//! wrong values. V7 is reserved for the loop-back at bring-up.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::spi::SpiDevice;

use crate::{CHANNELS, Edge, Fault, Gauges};

/// Inputs of the part.
pub const INPUTS: usize = 8;
/// CONVST low if the program generates the edge ([`Pulse`](crate::Pulse)), ns.
pub const CONVST_LOW: u32 = 30;
/// Time from the rising edge of CONVST to the first poll of BUSY, ns.
pub const BUSY_DELAY: u32 = 50;
/// Longest time from that edge to the end of all conversions, ns.
pub const CONVERSION: u64 = 4_200;
/// Time between two polls of BUSY, ns.
pub const POLL: u32 = 50;
/// Polls of BUSY before the timeout: at least 10 µs, twice the longest conversion.
pub const POLLS: u32 = 200;
/// Width of the RESET pulse, ns.
pub const RESET_HIGH: u32 = 4_000;
/// Time from the end of RESET to the first start, ns.
pub const RESET_WAIT: u32 = 300_000;

/// Permitted range of V8, as codes of the part: 0 at the lowest input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Lowest code.
    pub low: i32,
    /// Highest code.
    pub high: i32,
}

impl Window {
    /// `millivolts` ± `tolerance` at an input range of ±`range`, all mV and below 20 V, in codes of `bits` (16 or 18).
    #[must_use]
    pub const fn around(millivolts: i32, tolerance: i32, range: i32, bits: u32) -> Self {
        Self { low: code_of(millivolts - tolerance, range, bits), high: code_of(millivolts + tolerance, range, bits) }
    }
}

/// The code of an input of so many mV at a range of ±`range` mV.
const fn code_of(millivolts: i32, range: i32, bits: u32) -> i32 {
    // In 64 bits: 40 V in mV times 2^18. The result is below 2^19 for an input within twice the range.
    ((((millivolts + range) as i64) << bits) / (2 * range as i64)) as i32
}

/// BUSY: high while the part converts.
pub trait BusyLine {
    /// Whether it is high.
    ///
    /// # Errors
    /// [`Fault::Pin`] if it cannot be read.
    fn is_high(&mut self) -> Result<bool, Fault>;

    /// Latches falling edges from now on.
    fn watch(&mut self) {}

    /// Whether a conversion has ended since [`BusyLine::watch`], or is running. A pin without a latch detects only the latter.
    ///
    /// # Errors
    /// [`Fault::Pin`] if it cannot be read.
    fn converts_again(&mut self) -> Result<bool, Fault> {
        self.is_high()
    }
}

impl<PIN: InputPin> BusyLine for PIN {
    #[inline]
    fn is_high(&mut self) -> Result<bool, Fault> {
        InputPin::is_high(self).map_err(|_| Fault::Pin)
    }
}

/// The part on its pins. `BITS` is 16 or 18: a frame of eight channels has as many bytes.
#[derive(Debug)]
pub struct Ad7606<const BITS: usize, SPI, START, BUSY, RESET, DELAY> {
    spi: SPI,
    start: START,
    busy: BUSY,
    reset: RESET,
    delay: DELAY,
    window: Window,
}

impl<const BITS: usize, SPI, START, BUSY, RESET, DELAY> Ad7606<BITS, SPI, START, BUSY, RESET, DELAY>
where
    SPI: SpiDevice,
    START: Edge,
    BUSY: BusyLine,
    RESET: OutputPin,
    DELAY: DelayNs,
{
    const WIDTH: () = assert!(BITS == 16 || BITS == 18, "AD7606 family: codes of 16 or 18 bits");

    /// A driver on these pins. `start` is CONVST A and B together; nothing is driven until [`Gauges::start`].
    pub const fn new(spi: SPI, start: START, busy: BUSY, reset: RESET, delay: DELAY, window: Window) -> Self {
        let () = Self::WIDTH;
        Self { spi, start, busy, reset, delay, window }
    }

    /// Reads all eight inputs as sampled at the CONVST edge of [`Gauges::begin`]: V1 to V8, 0 to 2^BITS − 1. Takes the rest of the
    /// 4 µs and the transfer; times out if the conversion does not end within 10 µs.
    ///
    /// # Errors
    /// Every [`Fault`] except [`Fault::NotStarted`], [`Fault::ReadBack`] and [`Fault::Code`]; [`Fault::Reference`] only after the
    /// rest was found valid.
    pub fn inputs(&mut self) -> Result<[i32; INPUTS], Fault> {
        self.converted()?;
        // Zeros are sent: SDI of the parts that have one ignores them in hardware mode.
        let mut frame = [0; BITS];
        self.spi.transfer_in_place(&mut frame).map_err(|_| Fault::Bus)?;
        if self.busy.converts_again()? {
            return Err(Fault::Again);
        }
        if frame.iter().all(|&byte| byte == 0) || frame.iter().all(|&byte| byte == 0xff) {
            return Err(Fault::Blank);
        }
        let codes = unpack(&frame);
        let [.., reference] = codes;
        if reference < self.window.low || reference > self.window.high {
            return Err(Fault::Reference);
        }
        Ok(codes)
    }

    /// Waits for the end of the conversion.
    fn converted(&mut self) -> Result<(), Fault> {
        for _ in 0..POLLS {
            if !self.busy.is_high()? {
                self.busy.watch();
                return Ok(());
            }
            self.delay.delay_ns(POLL);
        }
        Err(Fault::NotEnded)
    }

    /// Gives the pins back, in the order of [`Self::new`].
    pub fn release(self) -> (SPI, START, BUSY, RESET, DELAY) {
        (self.spi, self.start, self.busy, self.reset, self.delay)
    }
}

impl<const BITS: usize, SPI, START, BUSY, RESET, DELAY> Gauges for Ad7606<BITS, SPI, START, BUSY, RESET, DELAY>
where
    SPI: SpiDevice,
    START: Edge,
    BUSY: BusyLine,
    RESET: OutputPin,
    DELAY: DelayNs,
{
    const BITS: u32 = BITS as u32;

    /// Resets the part, which is required after power-up, and samples once. Takes 0.3 ms.
    fn start(&mut self) -> Result<(), Fault> {
        self.start.hold();
        self.reset.set_high().map_err(|_| Fault::Pin)?;
        self.delay.delay_ns(RESET_HIGH);
        self.reset.set_low().map_err(|_| Fault::Pin)?;
        self.delay.delay_ns(RESET_WAIT);
        let read = self.begin().and_then(|()| self.read());
        // Otherwise the timer might still be running when a tick requests the next edge.
        self.start.hold();
        read.map(|_| ())
    }

    fn begin(&mut self) -> Result<(), Fault> {
        self.start.give()?;
        self.delay.delay_ns(BUSY_DELAY);
        if self.busy.is_high()? { Ok(()) } else { Err(Fault::NotStarted) }
    }

    fn read(&mut self) -> Result<[i32; CHANNELS], Fault> {
        let [v1, v2, v3, v4, v5, v6, _, _] = self.inputs()?;
        Ok([v1, v2, v3, v4, v5, v6])
    }
}

/// Converts eight codes in two's complement, most significant bit first and without gaps, to codes from 0 on.
fn unpack<const BITS: usize>(frame: &[u8; BITS]) -> [i32; INPUTS] {
    let mut codes = [0; INPUTS];
    let mut bytes = frame.iter();
    let (mut bits, mut held) = (0_u32, 0);
    for code in &mut codes {
        while held < BITS {
            // Eight codes of BITS bits are exactly BITS bytes.
            bits = bits << 8 | u32::from(bytes.next().copied().unwrap_or_default());
            held += 8;
        }
        held -= BITS;
        let value = bits >> held & ((1 << BITS) - 1);
        // Inverting the sign bit maps the lowest input, −2^(BITS−1), to 0. At most 18 bits.
        *code = (value ^ 1 << (BITS - 1)) as i32;
    }
    codes
}
