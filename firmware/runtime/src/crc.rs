//! CRC-32/ISO-HDLC, the checksum of Ethernet and zip: polynomial 0x04c11db7, reflected, start and final exclusive-or all ones.
//!
//! Finds every change of up to 32 neighbouring bits, and of one, two or three bits anywhere in a controller's tables.
//! It works on half bytes with a table of 16 words: a controller checks a few kilobytes, once.
//!
//! # Example
//!
//! The check value of this checksum, that of the nine digits:
//!
//! ```
//! use specgen_runtime::Crc32;
//!
//! let mut crc = Crc32::new();
//! crc.bytes(b"123456789");
//! assert_eq!(crc.finish(), 0xcbf4_3926);
//! ```

use crate::real::Real;

/// Running checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crc32(u32);

/// The polynomial, reflected.
const POLYNOMIAL: u32 = 0xedb8_8320;

/// Remainders of the sixteen half bytes.
const REMAINDERS: [u32; 16] = {
    let mut table = [0; 16];
    let mut half = 0;
    while half < 16 {
        let mut remainder = half as u32;
        let mut bit = 0;
        while bit < 4 {
            remainder = if remainder & 1 == 1 { (remainder >> 1) ^ POLYNOMIAL } else { remainder >> 1 };
            bit += 1;
        }
        table[half] = remainder;
        half += 1;
    }
    table
};

impl Default for Crc32 {
    fn default() -> Self {
        Self::new()
    }
}

impl Crc32 {
    /// Of nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self(!0)
    }

    /// Adds a byte.
    #[inline]
    pub fn byte(&mut self, byte: u8) {
        let mut remainder = self.0 ^ byte as u32;
        remainder = (remainder >> 4) ^ REMAINDERS[(remainder & 15) as usize];
        remainder = (remainder >> 4) ^ REMAINDERS[(remainder & 15) as usize];
        self.0 = remainder;
    }

    /// Adds bytes in their order.
    pub fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.byte(*byte);
        }
    }

    /// Adds a word, lowest byte first.
    pub fn word(&mut self, word: u64) {
        self.bytes(&word.to_le_bytes());
    }

    /// Adds words in their order.
    pub fn words(&mut self, words: &[u64]) {
        for word in words {
            self.word(*word);
        }
    }

    /// Adds numbers by their words ([`Real::to_word`]).
    pub fn reals<T: Real>(&mut self, values: &[T]) {
        for value in values {
            self.word(value.to_word());
        }
    }

    /// The checksum so far.
    #[must_use]
    pub const fn finish(self) -> u32 {
        !self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bit by bit, from the definition.
    fn by_definition(bytes: &[u8]) -> u32 {
        let mut crc = !0_u32;
        for byte in bytes {
            for bit in 0..8 {
                let feedback = (crc ^ u32::from(byte >> bit)) & 1;
                crc = (crc >> 1) ^ (feedback * POLYNOMIAL);
            }
        }
        !crc
    }

    fn of(bytes: &[u8]) -> u32 {
        let mut crc = Crc32::new();
        crc.bytes(bytes);
        crc.finish()
    }

    #[test]
    fn the_check_value_of_the_catalogue_and_the_definition_are_met() {
        assert_eq!(of(b"123456789"), 0xcbf4_3926);
        assert_eq!(of(b""), 0);
        let mut state = 7_u64;
        let mut bytes = [0; 257];
        for byte in &mut bytes {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            *byte = (state >> 56) as u8;
        }
        for length in 0..bytes.len() {
            assert_eq!(of(&bytes[..length]), by_definition(&bytes[..length]), "{length} bytes");
        }
    }

    #[test]
    fn every_single_flipped_bit_changes_it() {
        let numbers = [1.5_f64, -0.0, 3e-7, 0.0, f64::MAX];
        let words = numbers.map(Real::to_word);
        let (mut good, mut same) = (Crc32::new(), Crc32::new());
        good.reals(&numbers);
        same.words(&words);
        assert_eq!(good, same);
        for place in 0..words.len() {
            for bit in 0..64 {
                let mut flipped = words;
                flipped[place] ^= 1 << bit;
                let mut crc = Crc32::new();
                crc.words(&flipped);
                assert_ne!(crc, good, "word {place}, bit {bit}");
            }
        }
    }
}
