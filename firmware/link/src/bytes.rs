//! Words of a controller in a message: 64 bits each, little endian, as in `controller::INPUT_NAMES` and its like.

use core::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

/// Most words of a message: more than any controller has inputs, outputs or settings.
pub const WORDS: usize = 120;
const WORD: usize = size_of::<u64>();
/// Most knots of a message: six numbers of 32 bits each, little endian.
pub const KNOTS: usize = 20;
const NUMBER: usize = size_of::<i32>();
/// Bytes of a knot.
pub const KNOT: usize = 6 * NUMBER;
const _: () = assert!(KNOTS * KNOT + 16 < crate::MESSAGE);

/// Raw bytes in a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    /// The words, if the bytes are `count` of them.
    #[must_use]
    pub fn words(self, count: usize) -> Option<impl Iterator<Item = u64> + 'a> {
        let words = self.0.chunks_exact(WORD);
        let whole = words.remainder().is_empty() && words.len() == count;
        whole.then(|| words.map(|word| u64::from_le_bytes(word.try_into().unwrap_or_default())))
    }

    /// Fills `words`; false, with nothing written, if the number of bytes does not match.
    #[must_use]
    pub fn read_words(self, words: &mut [u64]) -> bool {
        let Some(values) = self.words(words.len()) else { return false };
        for (slot, value) in words.iter_mut().zip(values) {
            *slot = value;
        }
        true
    }

    /// The knots, if the bytes are whole ones.
    #[must_use]
    pub fn knots(self) -> Option<impl ExactSizeIterator<Item = [i32; 6]> + 'a> {
        let knots = self.0.chunks_exact(KNOT);
        knots.remainder().is_empty().then(|| knots.map(knot))
    }
}

fn knot(bytes: &[u8]) -> [i32; 6] {
    let mut knot = [0; 6];
    for (slot, number) in knot.iter_mut().zip(bytes.chunks_exact(NUMBER)) {
        *slot = i32::from_le_bytes(number.try_into().unwrap_or_default());
    }
    knot
}

/// The bytes of `knots` from `offset` on, in `buffer`: as many as there are and fit.
#[must_use]
pub fn put_knots<'a>(knots: &[[i32; 6]], offset: usize, buffer: &'a mut [u8]) -> &'a [u8] {
    let skipped = offset / KNOT;
    let bytes = knots.iter().skip(skipped).flatten().flat_map(|number| number.to_le_bytes());
    let mut count = 0;
    for (slot, byte) in buffer.iter_mut().zip(bytes.skip(offset - skipped * KNOT)) {
        *slot = byte;
        count += 1;
    }
    buffer.get(..count).unwrap_or_default()
}

/// `words` as bytes, in `buffer`; none if they do not fit.
#[must_use]
pub fn put_words<'a>(words: &[u64], buffer: &'a mut [u8]) -> Option<Bytes<'a>> {
    let buffer = buffer.get_mut(..size_of_val(words))?;
    for (slot, word) in buffer.chunks_exact_mut(WORD).zip(words) {
        for (byte, value) in slot.iter_mut().zip(word.to_le_bytes()) {
            *byte = value;
        }
    }
    Some(Bytes(buffer))
}

impl Serialize for Bytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.0)
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Bytes<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_bytes(BytesVisitor)
    }
}

struct BytesVisitor;

impl<'de> Visitor<'de> for BytesVisitor {
    type Value = Bytes<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_borrowed_bytes<E: Error>(self, bytes: &'de [u8]) -> Result<Self::Value, E> {
        Ok(Bytes(bytes))
    }
}
