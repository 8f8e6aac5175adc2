//! The record format: in memory, over a link and in a file.
//!
//! A **block** is a run of 64-bit words that can be replayed by itself:
//!
//! ```text
//! 0        "SPGBLOCK"
//! 1        words of the block, this header included
//! 2        rows
//! 3        tick of the first row, from 0 at the recorder's first
//! 4        why it begins (see Reason), its decimation << 32
//! 5        digest of the machine before the first row
//! 6        words of the settings, of an input << 16, of a state << 32
//! 7        tick of the trigger; all ones if it was not in this block
//! 8…       settings, state before the first row, rows
//! ```
//! A **row** is a tick, or one in `decimation` of them. Word 0 says which of the input words differ from those of the row
//! before (bits 0 to 59; before the first row of a block all are zero) and whether a digest follows (bit 63):
//!
//! ```text
//! 0        which input words follow
//! …        these input words, in order
//! +0…+2    converter codes of legs 0 and 1, 2 and 3, 4 and 5; the second << 32
//! +3       status of the tick, the supervisor's word (phase, cause << 8, amplifiers on << 16) << 32
//! +4       digest of the machine after the tick, if bit 63 of word 0 is set
//! ```
//! A **file**, little endian, is "SPGRECRD", the format's version (u32), the length of a text (u32, a multiple of 8), the text
//! (`key=value` lines: what the controller says of itself), the CRC-32 of all that as a word of 64 bits, then blocks, each
//! followed by its CRC-32 as a word. A file that is cut off loses no more than its last block.

use crate::choice::choice;
use crate::crc::Crc32;

/// First bytes of a file.
pub const FILE_MAGIC: [u8; 8] = *b"SPGRECRD";
/// Version of the format.
pub const FORMAT: u32 = 1;
/// First word of a block.
pub const BLOCK_MAGIC: u64 = u64::from_le_bytes(*b"SPGBLOCK");
/// Words before the settings of a block.
pub const HEADER_WORDS: usize = 8;
/// Most words that an input may have.
pub const LARGEST_INPUT: usize = 60;
/// Words of a row's outputs, the digest left out.
pub const OUTPUT_WORDS: usize = 4;
/// Bit of a row's first word: a digest ends it.
pub const HAS_DIGEST: u64 = 1 << 63;
/// A block without a trigger.
pub const NO_TRIGGER: u64 = u64::MAX;

choice! {
    /// Reason why a block begins.
    pub enum Reason {
        /// The recorder was started.
        Started = 0,
        /// The block before it was full. The ticks are consecutive.
        Continued = 1,
        /// The settings changed. The ticks are consecutive.
        Settings = 2,
    }
}

/// Sizes of a controller's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Of its settings.
    pub config: usize,
    /// Of an input, at most [`LARGEST_INPUT`].
    pub input: usize,
    /// Of its state.
    pub state: usize,
}

impl Layout {
    /// Words of a block before its first row.
    #[must_use]
    pub const fn preamble(&self) -> usize {
        HEADER_WORDS + self.config + self.state
    }

    /// Words of the longest row.
    #[must_use]
    pub const fn longest_row(&self) -> usize {
        1 + self.input + OUTPUT_WORDS + 1
    }

    /// Word 6 of a block.
    #[must_use]
    pub const fn word(&self) -> u64 {
        self.config as u64 | (self.input as u64) << 16 | (self.state as u64) << 32
    }
}

/// [`Crc32`] of words in little-endian order, as it follows a block in a file. Not for the tick: it takes about 100
/// instructions a word.
#[must_use]
pub fn checksum(words: &[u64]) -> u64 {
    let mut crc = Crc32::new();
    crc.words(words);
    u64::from(crc.finish())
}

/// Writes the start of a file with the text `description`, without the padding of the text: calls `out` with the
/// pieces.
///
/// # Errors
/// The first error of `out`.
pub fn write_header<E>(description: &str, mut out: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
    const PADDING: [u8; 8] = [b'\n'; 8];
    let text = description.as_bytes();
    let padding = PADDING.get(..text.len().wrapping_neg() % 8).unwrap_or_default();
    let length = (text.len() + padding.len()) as u32;
    let mut crc = Crc32::new();
    for piece in [&FILE_MAGIC[..], &FORMAT.to_le_bytes()[..], &length.to_le_bytes()[..], text, padding] {
        crc.bytes(piece);
        out(piece)?;
    }
    out(&u64::from(crc.finish()).to_le_bytes())
}

/// Writes a block of a file with its checksum: calls `out` with the pieces.
///
/// # Errors
/// The first error of `out`.
pub fn write_block<E>(block: &[u64], mut out: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
    for word in block {
        out(&word.to_le_bytes())?;
    }
    out(&checksum(block).to_le_bytes())
}
