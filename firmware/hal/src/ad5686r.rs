//! Two AD5686R: eight DAC channels of 16 bits, six of which drive amplifiers.
//!
//! From the data sheet (AD5686R/AD5685R/AD5684R Rev. B); stand-alone mode, both parts on one SPI, each with its own SYNC.
//!
//! | what | as used here |
//! | --- | --- |
//! | frame | 24 bits, MSB first: command C3–C0, address D C B A (one bit a channel), 16 data bits |
//! | SPI | mode 1: data are sampled on falling SCLK; SYNC low for the frame, high for 30 ns between frames |
//! | SCLK | at most 50 MHz where nothing comes back: 25 MHz or less is used |
//! | SDO | valid up to 25 ns after rising SCLK, for VLOGIC of 2.7 V and more and 20 pF; taken on the falling edge, half a cycle later. Frames that only write go by `write` of the SPI, frames whose answer counts by `transfer_in_place`, which is to have a clock slow enough for SDO and its wire: docs/bring-up.md has the figures |
//! | LDAC | held high; a low pulse of 15 ns or more transfers all input registers to the outputs of both parts simultaneously |
//! | read-back | command 1001 with one channel: the next frame returns its DAC register in the lower 16 bits |
//! | power-up | all channels on, at zero scale with RSTSEL low, internal reference on; RESET high, GAIN low 2.5 V or high 5 V |
//!
//! | command | word |
//! | --- | --- |
//! | no operation | `0x000000` |
//! | write input register | `0x1axxxx` |
//! | write input and DAC register | `0x3axxxx` |
//! | power up all channels | `0x4f0000` |
//! | LDAC works on all channels | `0x500000` |
//! | software reset | `0x600000` |
//! | internal reference on | `0x700000` |
//! | no daisy chain | `0x800000` |
//! | read back | `0x9a0000` |
//!
//! Legs 0 to 2 are channels A, B, C of the first part, legs 3 to 5 those of the second. Every tick reads back one channel, alternating
//! between the parts, so each channel once in six ticks. It must return the code written in the tick before. A channel that returned
//! another code is a fault in every tick until it returns the right one. The read-back takes place during the conversion of the gauges.
//! The codes of a tick alternate between the parts, so that SYNC of one is high during a frame of the other.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;

use crate::{Amplifiers, CHANNELS, Edge, Fault};

/// Channels of a part that drive legs: A, B, C.
pub const LEGS_PER_PART: usize = 3;
/// Largest code.
pub const LARGEST: i32 = 0xffff;
/// SYNC high between two consecutive frames of a part, and from the last frame to LDAC, ns.
pub const SYNC_HIGH: u32 = 30;
/// Width of an LDAC pulse from the program ([`Pulse`](crate::Pulse)), ns.
pub const LDAC_LOW: u32 = 30;
/// Patterns that channel D, which drives nothing, must return at start.
pub const PATTERNS: [u16; 2] = [0xa55a, 0x5aa5];

/// A channel of a part: its address bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Channel {
    /// DAC A.
    A = 1,
    /// DAC B.
    B = 2,
    /// DAC C.
    C = 4,
    /// DAC D, which drives no leg.
    D = 8,
}

const ALL: u8 = 0xf;

/// Commands to a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// No operation; returns the requested register.
    NoOperation,
    /// Writes the input register, which the next LDAC transfers to the output.
    WriteInput(Channel, u16),
    /// Writes input and DAC register immediately.
    WriteThrough(Channel, u16),
    /// Writes input and DAC registers of all channels immediately.
    WriteThroughAll(u16),
    /// All channels on.
    PowerUp,
    /// LDAC acts on all channels.
    LdacUnmasked,
    /// Software reset to the power-up state.
    Reset,
    /// Internal reference on.
    ReferenceOn,
    /// Stand-alone mode.
    NoDaisyChain,
    /// The next frame returns this DAC register.
    ReadBack(Channel),
}

impl Command {
    /// The 24 bits, most significant byte first.
    #[must_use]
    pub const fn frame(self) -> [u8; 3] {
        let (command, address, data) = match self {
            Self::NoOperation => (0x0, 0, 0),
            Self::WriteInput(channel, code) => (0x1, channel as u8, code),
            Self::WriteThrough(channel, code) => (0x3, channel as u8, code),
            Self::WriteThroughAll(code) => (0x3, ALL, code),
            Self::PowerUp => (0x4, ALL, 0),
            Self::LdacUnmasked => (0x5, 0, 0),
            Self::Reset => (0x6, 0, 0),
            Self::ReferenceOn => (0x7, 0, 0),
            Self::NoDaisyChain => (0x8, 0, 0),
            Self::ReadBack(channel) => (0x9, channel as u8, 0),
        };
        let [high, low] = data.to_be_bytes();
        [command << 4 | address, high, low]
    }
}

/// One part: its SPI with SYNC.
#[derive(Debug)]
struct Part<SPI> {
    spi: SPI,
}

impl<SPI: SpiDevice> Part<SPI> {
    /// Sends a frame and ignores the answer.
    #[inline]
    fn send(&mut self, command: Command) -> Result<(), Fault> {
        self.spi.write(&command.frame()).map_err(|_| Fault::Bus)
    }

    /// The register of a channel: the lower 16 bits of the frame after the read-back command.
    #[inline]
    fn read_back(&mut self, channel: Channel, delay: &mut impl DelayNs) -> Result<u16, Fault> {
        self.send(Command::ReadBack(channel))?;
        delay.delay_ns(SYNC_HIGH);
        let mut frame = Command::NoOperation.frame();
        self.spi.transfer_in_place(&mut frame).map_err(|_| Fault::Bus)?;
        let [_, high, low] = frame;
        Ok(u16::from_be_bytes([high, low]))
    }

    /// Resets the part to its power-up state with outputs at zero, and checks that it answers.
    fn start(&mut self, delay: &mut impl DelayNs) -> Result<(), Fault> {
        const SETTINGS: [Command; 6] = [
            Command::Reset,
            Command::NoDaisyChain,
            Command::ReferenceOn,
            Command::LdacUnmasked,
            Command::PowerUp,
            Command::WriteThroughAll(0),
        ];
        for command in SETTINGS {
            self.send(command)?;
            delay.delay_ns(SYNC_HIGH);
        }
        for pattern in PATTERNS.into_iter().chain([0]) {
            self.send(Command::WriteThrough(Channel::D, pattern))?;
            delay.delay_ns(SYNC_HIGH);
            if self.read_back(Channel::D, delay)? != pattern {
                return Err(Fault::ReadBack);
            }
            delay.delay_ns(SYNC_HIGH);
        }
        Ok(())
    }
}

/// Two parts, their common LDAC, and the line that enables the amplifiers.
#[derive(Debug)]
pub struct Ad5686rPair<FIRST, SECOND, LDAC, ENABLE, DELAY> {
    first: Part<FIRST>,
    second: Part<SECOND>,
    ldac: LDAC,
    enable: ENABLE,
    delay: DELAY,
    /// Whether the amplifiers are enabled.
    on: bool,
    /// Contents of the DAC registers, if known.
    written: Option<[u16; CHANNELS]>,
    /// Whether the last written codes differ from those before, which are at the outputs.
    changed: bool,
    /// Channels whose last answer was a wrong code: a bit for each `turn`.
    refuted: u8,
    /// The channel to read back next, 0 to 5: A of the first part, A of the second, B of the first, and so on.
    turn: u8,
}

impl<FIRST, SECOND, LDAC, ENABLE, DELAY> Ad5686rPair<FIRST, SECOND, LDAC, ENABLE, DELAY>
where
    FIRST: SpiDevice,
    SECOND: SpiDevice,
    LDAC: Edge,
    ENABLE: OutputPin,
    DELAY: DelayNs,
{
    /// Takes the pins; nothing is driven until [`Amplifiers::start`]. `enable` is active high.
    pub const fn new(first: FIRST, second: SECOND, ldac: LDAC, enable: ENABLE, delay: DELAY) -> Self {
        Self {
            first: Part { spi: first },
            second: Part { spi: second },
            ldac,
            enable,
            delay,
            on: false,
            written: None,
            changed: true,
            refuted: 0,
            turn: 0,
        }
    }

    /// Gives the pins back, in the order of [`Self::new`].
    pub fn release(self) -> (FIRST, SECOND, LDAC, ENABLE, DELAY) {
        (self.first.spi, self.second.spi, self.ldac, self.enable, self.delay)
    }
}

impl<FIRST, SECOND, LDAC, ENABLE, DELAY> Amplifiers for Ad5686rPair<FIRST, SECOND, LDAC, ENABLE, DELAY>
where
    FIRST: SpiDevice,
    SECOND: SpiDevice,
    LDAC: Edge,
    ENABLE: OutputPin,
    DELAY: DelayNs,
{
    const BITS: u32 = 16;

    /// Disables the amplifiers, resets both parts with outputs at zero, and checks that both answer: channel D of each must return
    /// [`PATTERNS`].
    fn start(&mut self) -> Result<(), Fault> {
        (self.written, self.refuted) = (None, 0);
        self.enable(false)?;
        self.ldac.hold();
        // Start both, so that the other is at zero even if one does not answer.
        let first = self.first.start(&mut self.delay);
        let second = self.second.start(&mut self.delay);
        first.and(second)?;
        self.written = Some([0; CHANNELS]);
        Ok(())
    }

    /// Two frames to one part.
    fn ask(&mut self) -> Result<(), Fault> {
        // The codes of the last tick are at the outputs, and the new ones must not be output partially.
        self.ldac.hold();
        let Some([a, b, c, d, e, f]) = self.written else { return Ok(()) };
        let (channel, [of_first, of_second]) = match self.turn / 2 {
            0 => (Channel::A, [a, d]),
            1 => (Channel::B, [b, e]),
            _ => (Channel::C, [c, f]),
        };
        let is_right = match self.turn % 2 {
            0 => self.first.read_back(channel, &mut self.delay)? == of_first,
            _ => self.second.read_back(channel, &mut self.delay)? == of_second,
        };
        let bit = 1 << self.turn;
        self.refuted = if is_right { self.refuted & !bit } else { self.refuted | bit };
        self.turn = if self.turn < CHANNELS as u8 - 1 { self.turn + 1 } else { 0 };
        if self.refuted == 0 { Ok(()) } else { Err(Fault::ReadBack) }
    }

    /// Six frames and LDAC. If one part fails, the other still gets its codes.
    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        if codes.iter().any(|&code| !(0..=LARGEST).contains(&code)) {
            return Err(Fault::Code);
        }
        // Checked to have 16 bits.
        let [a, b, c, d, e, f] = codes.map(|code| code as u16);
        self.changed = self.written.take() != Some([a, b, c, d, e, f]);
        let mut sent = Ok(());
        for (channel, codes) in [(Channel::A, [a, d]), (Channel::B, [b, e]), (Channel::C, [c, f])] {
            let [first, second] = codes.map(|code| Command::WriteInput(channel, code));
            let results = [self.first.send(first), self.second.send(second)];
            for result in results {
                sent = sent.and(result);
            }
        }
        self.delay.delay_ns(SYNC_HIGH);
        self.ldac.give()?;
        sent?;
        self.written = Some([a, b, c, d, e, f]);
        Ok(())
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        if on && !self.on && self.changed {
            self.ldac.settle();
        }
        self.on = on;
        let result = if on { self.enable.set_high() } else { self.enable.set_low() };
        result.map_err(|_| Fault::Pin)
    }
}
