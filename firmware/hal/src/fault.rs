//! Faults of a converter.

use core::fmt;

/// Fault of a converter. The numbers are sent over the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// The SPI controller reports an error (overrun, mode fault).
    Bus = 1,
    /// A pin cannot be driven or read.
    Pin = 2,
    /// The conversion did not start: BUSY stayed low. No supply, no CONVST, or no part.
    NotStarted = 3,
    /// The conversion did not end in time: BUSY stayed high. BUSY is not connected, or the part is in reset.
    NotEnded = 4,
    /// All bits of the frame are equal: the data line is stuck or open.
    Blank = 5,
    /// The channel connected to the reference voltage does not read it: supply, reference or range are wrong.
    Reference = 6,
    /// The part returned a code other than the one sent.
    ReadBack = 7,
    /// A code is outside of the converter's range.
    Code = 8,
    /// An unexpected conversion started or ended while the frame was read: its words are from two conversions.
    Again = 9,
}

impl Fault {
    /// All faults.
    pub const ALL: [Self; 9] = [
        Self::Bus,
        Self::Pin,
        Self::NotStarted,
        Self::NotEnded,
        Self::Blank,
        Self::Reference,
        Self::ReadBack,
        Self::Code,
        Self::Again,
    ];

    /// Its number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Its bit in a word of all detected faults: bit `number`.
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bus => "the SPI controller reports an error",
            Self::Pin => "a pin cannot be driven or read",
            Self::NotStarted => "BUSY stayed low: is the ADC supplied, and is CONVST connected?",
            Self::NotEnded => "BUSY stayed high: is it connected, and is the ADC out of reset?",
            Self::Blank => "all bits of the ADC's frame are equal: is DOUTA connected?",
            Self::Reference => {
                "channel V8 does not read the reference: are RANGE, supply and V8 as in the wiring table?"
            }
            Self::ReadBack => "a DAC returned a code other than the one sent: are SDO, SYNC and SCLK connected?",
            Self::Code => "a code is outside the converter's range",
            Self::Again => "BUSY rose again while the ADC was read: is there interference on CONVST?",
        })
    }
}
