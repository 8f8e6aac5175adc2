//! Two AD5686R: eight DAC channels of 16 bits, of which six drive amplifiers.
//!
//! From the data sheet (AD5686R/AD5685R/AD5684R Rev. B); stand-alone mode, both parts on one SPI, each with its SYNC.
//!
//! | what | as used here |
//! | --- | --- |
//! | frame | 24 bits, MSB first: command C3–C0, address D C B A (one bit a channel), 16 data bits |
//! | SPI | mode 1: data are taken on falling SCLK; SYNC low for the frame, high for 30 ns between frames |
//! | SCLK | at most 50 MHz, 25 MHz with read-back at VLOGIC of 2.7 V and more: 25 MHz or less is used |
//! | LDAC | held high; a low pulse of 15 ns or more moves all input registers to the outputs of both parts at once |
//! | read-back | command 1001 with one channel: the next frame brings out its DAC register in the lower 16 bits |
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
//! Legs 0 to 2 are channels A, B, C of the first part, legs 3 to 5 those of the second. In every tick one channel of each
//! part is read back, so each within three ticks: what it gives must be the code written in the tick before. The question goes
//! out while the gauges are converted, the answer comes with the first code. Frames of a tick alternate between the parts: SYNC
//! of one is high for as long as a frame of the other lasts.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;

use crate::{Amplifiers, CHANNELS, Edge, Fault};

/// Channels of a part that drive legs: A, B, C.
pub const LEGS_PER_PART: usize = 3;
/// Largest code.
pub const LARGEST: i32 = 0xffff;
/// SYNC high between two frames of a part that follow each other, and from the last frame to LDAC, ns.
pub const SYNC_HIGH: u32 = 30;
/// LDAC low where the program gives it ([`Pulse`](crate::Pulse)), ns.
pub const LDAC_LOW: u32 = 30;
/// Patterns that channel D, which drives nothing, must give back before a part is believed.
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
    /// Nothing; brings out what was asked for.
    NoOperation,
    /// To the input register: goes to the output with the next LDAC.
    WriteInput(Channel, u16),
    /// To input and DAC register, at once.
    WriteThrough(Channel, u16),
    /// To input and DAC registers of all channels, at once.
    WriteThroughAll(u16),
    /// All channels on.
    PowerUp,
    /// LDAC works on all channels.
    LdacUnmasked,
    /// As after power-up.
    Reset,
    /// Internal reference on.
    ReferenceOn,
    /// Stand-alone.
    NoDaisyChain,
    /// The next frame brings out this DAC register.
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
    /// Sends a frame and returns the lower 16 bits of what came back meanwhile.
    #[inline]
    fn send(&mut self, command: Command) -> Result<u16, Fault> {
        let mut frame = command.frame();
        self.spi.transfer_in_place(&mut frame).map_err(|_| Fault::Bus)?;
        let [_, high, low] = frame;
        Ok(u16::from_be_bytes([high, low]))
    }

    /// Power-up state, outputs at zero, and proof that the part answers.
    fn start(&mut self, delay: &mut impl DelayNs) -> Result<(), Fault> {
        const SETTINGS: [Command; 6] = [
            Command::Reset,
            Command::NoDaisyChain,
            Command::ReferenceOn,
            Command::LdacUnmasked,
            Command::PowerUp,
            Command::WriteThroughAll(0),
        ];
        let mut send = |command| {
            let answer = self.send(command);
            delay.delay_ns(SYNC_HIGH);
            answer
        };
        for command in SETTINGS {
            send(command)?;
        }
        for pattern in PATTERNS.into_iter().chain([0]) {
            send(Command::WriteThrough(Channel::D, pattern))?;
            send(Command::ReadBack(Channel::D))?;
            if send(Command::NoOperation)? != pattern {
                return Err(Fault::ReadBack);
            }
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
    /// What stands in the DAC registers, as far as is known.
    written: Option<[u16; CHANNELS]>,
    /// Whether the codes that were written last are others than those before them, which are out.
    changed: bool,
    /// What both parts were asked for must give this.
    asked: Option<[u16; 2]>,
    /// Which of the three channels is asked for next.
    turn: usize,
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
            asked: None,
            turn: 0,
        }
    }

    /// Gives the pins back, in the order of [`Self::new`].
    pub fn release(self) -> (FIRST, SECOND, LDAC, ENABLE, DELAY) {
        (self.first.spi, self.second.spi, self.ldac, self.enable, self.delay)
    }

    /// The next channel to ask for, with what it must give: none where nothing is known.
    fn question(&mut self) -> Option<(Channel, [u16; 2])> {
        let [a, b, c, d, e, f] = self.written?;
        let question = match self.turn {
            0 => (Channel::A, [a, d]),
            1 => (Channel::B, [b, e]),
            _ => (Channel::C, [c, f]),
        };
        self.turn = if self.turn < LEGS_PER_PART - 1 { self.turn + 1 } else { 0 };
        Some(question)
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

    /// Amplifiers disabled, both parts at power-up state with outputs at zero, and both proved to answer: channel D of each
    /// gives [`PATTERNS`] back.
    fn start(&mut self) -> Result<(), Fault> {
        (self.written, self.asked) = (None, None);
        self.enable(false)?;
        self.ldac.hold();
        // Both, so that one part that does not answer leaves the other at zero.
        let first = self.first.start(&mut self.delay);
        let second = self.second.start(&mut self.delay);
        first.and(second)?;
        self.written = Some([0; CHANNELS]);
        Ok(())
    }

    /// One frame to each part.
    fn ask(&mut self) -> Result<(), Fault> {
        // The codes of the last tick are out by now, and these are not to go out by halves.
        self.ldac.hold();
        self.asked = None;
        let Some((channel, expected)) = self.question() else { return Ok(()) };
        let first = self.first.send(Command::ReadBack(channel));
        let second = self.second.send(Command::ReadBack(channel));
        first.and(second)?;
        self.asked = Some(expected);
        Ok(())
    }

    /// Six frames and LDAC. Codes go out even where a read-back differs: the other channels need theirs.
    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        if codes.iter().any(|&code| !(0..=LARGEST).contains(&code)) {
            return Err(Fault::Code);
        }
        // Checked: 16 bits.
        let [a, b, c, d, e, f] = codes.map(|code| code as u16);
        let asked = self.asked.take();
        self.changed = self.written.take() != Some([a, b, c, d, e, f]);
        // The frame after the question brings the answer.
        let first = self.first.send(Command::WriteInput(Channel::A, a));
        let second = self.second.send(Command::WriteInput(Channel::A, d));
        let mut sent = [first.map(|_| ()), second.map(|_| ())];
        for (channel, codes) in [(Channel::B, [b, e]), (Channel::C, [c, f])] {
            let [first, second] = codes.map(|code| Command::WriteInput(channel, code));
            let results = [self.first.send(first), self.second.send(second)];
            for (sent, result) in sent.iter_mut().zip(results) {
                *sent = sent.and(result.map(|_| ()));
            }
        }
        self.delay.delay_ns(SYNC_HIGH);
        self.ldac.give()?;
        let [one, other] = sent;
        one.and(other)?;
        self.written = Some([a, b, c, d, e, f]);
        match (asked, first, second) {
            (Some(expected), Ok(one), Ok(other)) if [one, other] != expected => Err(Fault::ReadBack),
            _ => Ok(()),
        }
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
