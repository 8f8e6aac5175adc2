//! Fingerprint of a state: FNV-1a, word by word. It compares two runs; it does not protect against forgery.
//!
//! # Example
//!
//! ```
//! use specgen_runtime::Digest;
//!
//! let of = |words: [u64; 2]| {
//!     let mut digest = Digest::new();
//!     words.map(|word| digest.word(word));
//!     digest.finish()
//! };
//! assert_eq!(of([1, 2]), of([1, 2]));
//! assert_ne!(of([1, 2]), of([2, 1])); // the order counts
//! ```

use crate::real::Real;

/// Running 64-bit digest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

impl Digest {
    /// The empty digest (FNV-1a offset basis).
    #[must_use]
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds a word.
    #[inline]
    pub fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        // Eight bytes at once leave the low bits unmixed with the high bits of the word; fold them down.
        self.0 ^= self.0 >> 32;
    }

    /// Adds a number by its bits.
    #[inline]
    pub fn real<T: Real>(&mut self, value: T) {
        self.word(value.to_word());
    }

    /// The digest so far.
    #[must_use]
    pub const fn finish(self) -> u64 {
        self.0
    }
}
