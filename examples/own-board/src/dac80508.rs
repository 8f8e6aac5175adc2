//! A DAC80508 for six legs, and the line that enables their amplifiers.
//!
//! From the data sheet (DACx0508, SLASEL0):
//!
//! | what | as used here |
//! | --- | --- |
//! | SPI | mode 1: bits are taken at the falling edge of SCLK; a frame is 24 bits: read bit, register, 16 bits of data |
//! | reading | what a frame asked for comes with the next one |
//! | outputs | reference 2.5 V of its own, gain 2: 0 to 5 V; all six change with one write to TRIGGER |
//! | reset | by TRIGGER; 250 µs later the part answers |
//!
//! In every tick one output's register is read back, each in its turn: a part that does not hold what it was sent is found
//! within six ticks. It is asked for while the gauges are converted, and comes with the first code.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;
use specgen_hal::{Amplifiers, CHANNELS, Fault};

/// Registers.
const DEVICE_ID: u8 = 0x01;
const SYNC: u8 = 0x02;
const GAIN: u8 = 0x04;
const TRIGGER: u8 = 0x05;
const OUTPUT: u8 = 0x08;
const READ: u8 = 0x80;
/// Of DEVICE_ID: resolution and number of channels, and what they are of a DAC80508 (16 bits, 8).
const KIND: u16 = 0x7f00;
const IS_DAC80508: u16 = 0x0800;
/// Of TRIGGER.
const SOFT_RESET: u16 = 0x000a;
const LOAD: u16 = 0x0010;
/// After a reset, ns.
const RESET: u32 = 300_000;
/// Gain 2 on all channels, reference undivided; outputs 0 to 5 change with LOAD.
const SETTINGS: [(u8, u16); 2] = [(GAIN, 0x00ff), (SYNC, 0x003f)];
/// Patterns that go through every output's register at start, before anything is loaded.
const PATTERNS: [u16; 3] = [0xa55a, 0x5aa5, 0];

/// The part on its pins.
#[derive(Debug)]
pub struct Dac80508<SPI, ENABLE, DELAY> {
    spi: SPI,
    enable: ENABLE,
    delay: DELAY,
    /// What its output registers are to hold.
    sent: [u16; CHANNELS],
    /// Whose turn it is to be read back.
    turn: usize,
    /// What the register that was asked for is to hold.
    asked: Option<u16>,
}

impl<SPI: SpiDevice, ENABLE: OutputPin, DELAY: DelayNs> Dac80508<SPI, ENABLE, DELAY> {
    /// Takes the pins. `enable` of the amplifiers is active high, and low until they are enabled.
    pub const fn new(spi: SPI, enable: ENABLE, delay: DELAY) -> Self {
        Self { spi, enable, delay, sent: [0; CHANNELS], turn: 0, asked: None }
    }

    /// One frame, and what came back with it.
    fn frame(&mut self, register: u8, data: u16) -> Result<u16, Fault> {
        let [high, low] = data.to_be_bytes();
        let mut frame = [register, high, low];
        self.spi.transfer_in_place(&mut frame).map_err(|_| Fault::Bus)?;
        let [_, high, low] = frame;
        Ok(u16::from_be_bytes([high, low]))
    }

    fn output(&mut self, leg: usize, code: u16) -> Result<(), Fault> {
        // Eight registers behind OUTPUT, six legs.
        self.frame(OUTPUT | (leg as u8 & 7), code).map(|_| ())
    }

    /// The register by a frame that asks and one that fetches.
    fn read(&mut self, register: u8) -> Result<u16, Fault> {
        self.frame(READ | register, 0)?;
        self.frame(0, 0)
    }

    fn prove(&mut self) -> Result<(), Fault> {
        if self.read(DEVICE_ID)? & KIND != IS_DAC80508 {
            return Err(Fault::ReadBack);
        }
        for (register, data) in SETTINGS {
            self.frame(register, data)?;
        }
        for pattern in PATTERNS {
            for leg in 0..CHANNELS {
                self.output(leg, pattern)?;
                if self.read(OUTPUT | (leg as u8 & 7))? != pattern {
                    return Err(Fault::ReadBack);
                }
            }
        }
        self.frame(TRIGGER, LOAD).map(|_| ())
    }
}

impl<SPI: SpiDevice, ENABLE: OutputPin, DELAY: DelayNs> Amplifiers for Dac80508<SPI, ENABLE, DELAY> {
    const BITS: u32 = 16;

    fn start(&mut self) -> Result<(), Fault> {
        // Off before anything else, and whatever the part says.
        self.enable(false)?;
        (self.sent, self.asked) = ([0; CHANNELS], None);
        self.frame(TRIGGER, SOFT_RESET)?;
        self.delay.delay_ns(RESET);
        self.prove()
    }

    fn ask(&mut self) -> Result<(), Fault> {
        self.asked = None;
        let turn = self.turn;
        self.turn = if turn + 1 < CHANNELS { turn + 1 } else { 0 };
        self.frame(READ | OUTPUT | (turn as u8 & 7), 0)?;
        self.asked = self.sent.get(turn).copied();
        Ok(())
    }

    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        let asked = self.asked.take();
        let mut words = [0; CHANNELS];
        for (word, code) in words.iter_mut().zip(codes) {
            *word = u16::try_from(*code).map_err(|_| Fault::Code)?;
        }
        let mut held = None;
        for (leg, word) in words.iter().enumerate() {
            let answer = self.frame(OUTPUT | (leg as u8 & 7), *word)?;
            held = held.or(Some(answer));
        }
        self.frame(TRIGGER, LOAD)?;
        self.sent = words;
        // The codes are out by now: what is wrong with one is the supervisor's business.
        if asked.is_none() || held == asked { Ok(()) } else { Err(Fault::ReadBack) }
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        let done = if on { self.enable.set_high() } else { self.enable.set_low() };
        done.map_err(|_| Fault::Pin)
    }
}
