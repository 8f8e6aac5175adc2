//! Frames: COBS(version, kind, session, sequence, message, CRC-32C), 0x00. Numbers are little endian.
//!
//! The CRC is that of Castagnoli (RFC 3720): it detects any five flipped bits in up to 655 bytes and any three in the
//! longest frame. COBS may turn a damaged frame into one with more errors. A fraction of 2⁻³² of those pass; length,
//! session and sequence number must then be right as well.

use crc::{CRC_32_ISCSI, Crc, Table};

/// Version of the protocol, the first byte of every frame.
pub const VERSION: u8 = 4;
/// Longest frame, bytes, with the zero at its end.
pub const FRAME: usize = 1024;
/// Longest message, bytes.
pub const MESSAGE: usize = BODY - HEADER - CHECKSUM;

/// COBS overhead of the longest body: one byte, and one more for every 254.
const STUFFING: usize = 5;
/// Longest body, bytes.
pub(crate) const BODY: usize = FRAME - 1 - STUFFING;
const HEADER: usize = 6;
const CHECKSUM: usize = 4;
const _: () = assert!(BODY.div_ceil(254) <= STUFFING);

/// Bit by bit if flash is scarce: a frame of 1 KiB then takes some 30,000 instructions of the background, and 11 ms on
/// the line of a board.
#[cfg(feature = "small")]
type Remainders = Table<0>;
/// Byte by byte, with a table of 1 KiB.
#[cfg(not(feature = "small"))]
type Remainders = Table<1>;

static CRC: Crc<u32, Remainders> = Crc::<u32, Remainders>::new(&CRC_32_ISCSI);

/// What a frame is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// From the host.
    Request,
    /// The device's answer to the request of the same sequence number.
    Reply,
    /// From the device, unasked.
    Telemetry,
    /// A kind unknown to this version.
    Unknown(u8),
}

impl Kind {
    fn byte(self) -> u8 {
        match self {
            Self::Request => 0,
            Self::Reply => 1,
            Self::Telemetry => 2,
            Self::Unknown(byte) => byte,
        }
    }

    fn of(byte: u8) -> Self {
        match byte {
            0 => Self::Request,
            1 => Self::Reply,
            2 => Self::Telemetry,
            _ => Self::Unknown(byte),
        }
    }
}

/// The header of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Version of the sender's protocol. Only the place of this byte is the same in every version.
    pub version: u8,
    /// What the frame is.
    pub kind: Kind,
    /// Chosen by the host when it opens the session, so that old bytes in a buffer are not accepted.
    pub session: u16,
    /// Counts requests; a repeated one has the same number.
    pub sequence: u16,
}

/// Reason why bytes between two zeros are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Damage {
    /// Longer than the longest body.
    Overlong,
    /// Not valid COBS, or too short.
    Malformed,
    /// The CRC is wrong.
    Checksum,
}

/// A frame with its own memory, of at most N bytes.
pub(crate) struct Frame<const N: usize = FRAME> {
    bytes: [u8; N],
    length: usize,
}

impl<const N: usize> Frame<N> {
    /// None yet.
    pub(crate) const EMPTY: Self = Self { bytes: [0; N], length: 0 };

    /// The bytes to send.
    pub(crate) fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Makes the frame of a message; false, with nothing to send, if the message is too long.
    pub(crate) fn set(&mut self, header: &Header, message: &impl serde::Serialize) -> bool {
        self.length = encode(header, message, &mut self.bytes).unwrap_or(0);
        self.length > 0
    }
}

/// Writes a frame with its zero; returns its length, or none if the message is too long.
pub(crate) fn encode(header: &Header, message: &impl serde::Serialize, out: &mut [u8]) -> Option<usize> {
    let mut body = [0; BODY];
    let [session_low, session_high] = header.session.to_le_bytes();
    let [sequence_low, sequence_high] = header.sequence.to_le_bytes();
    let start = [header.version, header.kind.byte(), session_low, session_high, sequence_low, sequence_high];
    for (slot, byte) in body.iter_mut().zip(start) {
        *slot = byte;
    }
    let room = body.get_mut(HEADER..BODY - CHECKSUM)?;
    let end = HEADER + postcard::to_slice(message, room).ok()?.len();
    let checksum = CRC.checksum(body.get(..end)?).to_le_bytes();
    for (slot, byte) in body.get_mut(end..)?.iter_mut().zip(checksum) {
        *slot = byte;
    }
    let length = cobs::try_encode(body.get(..end + CHECKSUM)?, out).ok()?;
    *out.get_mut(length)? = 0;
    Some(length + 1)
}

/// Header and message of a body.
pub(crate) fn open(body: &[u8]) -> Result<(Header, &[u8]), Damage> {
    let (body, checksum) = body.split_last_chunk::<CHECKSUM>().ok_or(Damage::Malformed)?;
    let (start, message) = body.split_first_chunk::<HEADER>().ok_or(Damage::Malformed)?;
    if CRC.checksum(body) != u32::from_le_bytes(*checksum) {
        return Err(Damage::Checksum);
    }
    let [version, kind, session_low, session_high, sequence_low, sequence_high] = *start;
    let header = Header {
        version,
        kind: Kind::of(kind),
        session: u16::from_le_bytes([session_low, session_high]),
        sequence: u16::from_le_bytes([sequence_low, sequence_high]),
    };
    Ok((header, message))
}

/// The message of a frame, if it is valid from the first byte to the last.
pub(crate) fn message<'a, T: serde::Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    let (message, rest) = postcard::take_from_bytes(bytes).ok()?;
    rest.is_empty().then_some(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables of boards and hosts differ, but must agree.
    #[test]
    fn the_checksum_is_that_of_the_catalogue_with_and_without_a_table() {
        let (bare, table) = (Crc::<u32, Table<0>>::new(&CRC_32_ISCSI), Crc::<u32, Table<1>>::new(&CRC_32_ISCSI));
        assert_eq!(CRC_32_ISCSI.check, 0xe306_9283);
        for crc in [bare.checksum(b"123456789"), table.checksum(b"123456789"), CRC.checksum(b"123456789")] {
            assert_eq!(crc, CRC_32_ISCSI.check);
        }
        let bytes: [u8; FRAME] = core::array::from_fn(|place| ((place * 151) >> 3) as u8);
        for length in 0..bytes.len() {
            assert_eq!(bare.checksum(&bytes[..length]), table.checksum(&bytes[..length]), "{length} bytes");
        }
    }
}
