//! Two AD5686R: eight DAC channels of 16 bits, of which six drive amplifiers.
//!
//! From the data sheet (AD5686R/AD5685R/AD5684R Rev. B); stand-alone mode, both parts on one SPI, each with its SYNC.
//!
//! | what | as used here |
//! | --- | --- |
//! | frame | 24 bits, MSB first: command C3–C0, address D C B A (one bit a channel), 16 data bits |
//! | SPI | mode 1: data are taken on falling SCLK; SYNC low for the frame, high for 30 ns between frames |
//! | SCLK | at most 50 MHz, 25 MHz with read-back at VLOGIC of 2.7 V and more: 12.5 MHz or less is used |
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
//! part is read back, so each within three ticks: what it gives must be the code written in the tick before.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;

use crate::{Amplifiers, CHANNELS, Fault};

/// Channels of a part that drive legs: A, B, C.
pub const LEGS_PER_PART: usize = 3;
/// Largest code.
pub const LARGEST: i32 = 0xffff;
/// SYNC high between two frames, ns.
pub const SYNC_HIGH: u32 = 50;
/// LDAC low, ns.
pub const LDAC_LOW: u32 = 50;
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

/// The three that drive legs.
const LEG_CHANNELS: [Channel; LEGS_PER_PART] = [Channel::A, Channel::B, Channel::C];
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
    fn send(&mut self, command: Command, delay: &mut impl DelayNs) -> Result<u16, Fault> {
        let mut frame = command.frame();
        self.spi.transfer_in_place(&mut frame).map_err(|_| Fault::Bus)?;
        delay.delay_ns(SYNC_HIGH);
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
        for command in SETTINGS {
            self.send(command, delay)?;
        }
        for pattern in PATTERNS.into_iter().chain([0]) {
            self.send(Command::WriteThrough(Channel::D, pattern), delay)?;
            self.send(Command::ReadBack(Channel::D), delay)?;
            if self.send(Command::NoOperation, delay)? != pattern {
                return Err(Fault::ReadBack);
            }
        }
        Ok(())
    }

    /// Three codes into the input registers. `check` says which channel is read back meanwhile, and what it must give.
    fn write(
        &mut self,
        codes: [u16; LEGS_PER_PART],
        check: Option<(Channel, u16)>,
        delay: &mut impl DelayNs,
    ) -> Result<(), Fault> {
        if let Some((channel, _)) = check {
            self.send(Command::ReadBack(channel), delay)?;
        }
        let mut came_back = None;
        for (channel, code) in LEG_CHANNELS.into_iter().zip(codes) {
            let answer = self.send(Command::WriteInput(channel, code), delay)?;
            // The frame after the question brings the answer.
            came_back = came_back.or(Some(answer));
        }
        match (check, came_back) {
            (Some((_, expected)), Some(found)) if found != expected => Err(Fault::ReadBack),
            _ => Ok(()),
        }
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
    /// What stands in the DAC registers, as far as is known.
    written: Option<[u16; CHANNELS]>,
    /// Which of the three channels is read back in the next write.
    turn: usize,
}

impl<FIRST, SECOND, LDAC, ENABLE, DELAY> Ad5686rPair<FIRST, SECOND, LDAC, ENABLE, DELAY>
where
    FIRST: SpiDevice,
    SECOND: SpiDevice,
    LDAC: OutputPin,
    ENABLE: OutputPin,
    DELAY: DelayNs,
{
    /// Takes the pins; nothing is driven until [`Amplifiers::start`]. `enable` is active high.
    pub const fn new(first: FIRST, second: SECOND, ldac: LDAC, enable: ENABLE, delay: DELAY) -> Self {
        Self { first: Part { spi: first }, second: Part { spi: second }, ldac, enable, delay, written: None, turn: 0 }
    }

    /// Gives the pins back, in the order of [`Self::new`].
    pub fn release(self) -> (FIRST, SECOND, LDAC, ENABLE, DELAY) {
        (self.first.spi, self.second.spi, self.ldac, self.enable, self.delay)
    }

    /// Input registers to outputs.
    fn load(&mut self) -> Result<(), Fault> {
        self.ldac.set_low().map_err(|_| Fault::Pin)?;
        self.delay.delay_ns(LDAC_LOW);
        self.ldac.set_high().map_err(|_| Fault::Pin)
    }

    /// What channel to read back in this write, with what it must give: for each part. None where nothing is known.
    fn check(&mut self) -> [Option<(Channel, u16)>; 2] {
        let Some([a, b, c, d, e, f]) = self.written else { return [None; 2] };
        let (channel, codes) = match self.turn {
            0 => (Channel::A, [a, d]),
            1 => (Channel::B, [b, e]),
            _ => (Channel::C, [c, f]),
        };
        self.turn = if self.turn < LEGS_PER_PART - 1 { self.turn + 1 } else { 0 };
        codes.map(|code| Some((channel, code)))
    }
}

impl<FIRST, SECOND, LDAC, ENABLE, DELAY> Amplifiers for Ad5686rPair<FIRST, SECOND, LDAC, ENABLE, DELAY>
where
    FIRST: SpiDevice,
    SECOND: SpiDevice,
    LDAC: OutputPin,
    ENABLE: OutputPin,
    DELAY: DelayNs,
{
    const BITS: u32 = 16;

    /// Amplifiers disabled, both parts at power-up state with outputs at zero, and both proved to answer: channel D of each
    /// gives [`PATTERNS`] back.
    fn start(&mut self) -> Result<(), Fault> {
        self.written = None;
        self.enable.set_low().map_err(|_| Fault::Pin)?;
        self.ldac.set_high().map_err(|_| Fault::Pin)?;
        // Both, so that one part that does not answer leaves the other at zero.
        let first = self.first.start(&mut self.delay);
        let second = self.second.start(&mut self.delay);
        first.and(second)?;
        self.written = Some([0; CHANNELS]);
        Ok(())
    }

    /// Eight frames and LDAC. Codes go out even where a read-back differs: the other channels need theirs.
    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        if codes.iter().any(|&code| !(0..=LARGEST).contains(&code)) {
            return Err(Fault::Code);
        }
        // Checked: 16 bits.
        let [a, b, c, d, e, f] = codes.map(|code| code as u16);
        let [first_check, second_check] = self.check();
        self.written = None;
        let first = self.first.write([a, b, c], first_check, &mut self.delay);
        let second = self.second.write([d, e, f], second_check, &mut self.delay);
        self.load()?;
        let sent = [first, second].iter().all(|result| matches!(result, Ok(()) | Err(Fault::ReadBack)));
        if sent {
            self.written = Some([a, b, c, d, e, f]);
        }
        first.and(second)
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        let result = if on { self.enable.set_high() } else { self.enable.set_low() };
        result.map_err(|_| Fault::Pin)
    }
}
