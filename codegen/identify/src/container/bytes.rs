//! Reads the bytes of a file in sequence, and numbers from them.

use std::io::{self, Read};

/// Error message for a file that ends early.
pub(super) const DAMAGED: &str = "it is damaged or cut off";

/// Most arrays of a file, with its texts and whatever else has a name.
pub(super) const MOST_ARRAYS: usize = 10_000;

/// Longest name, and longest text that is kept, bytes.
pub(super) const LONGEST_NAME: usize = 256;
pub(super) const LONGEST_TEXT: usize = 1 << 20;

/// Most dimensions of an array.
pub(super) const MOST_DIMENSIONS: usize = 32;

/// Reason why a file is not read.
#[derive(Debug)]
pub(crate) enum Refusal {
    /// A text that follows "cannot be read:".
    Because(String),
    /// More bytes than are permitted: this many, if known.
    Large(Option<u64>),
}

impl From<String> for Refusal {
    fn from(text: String) -> Self {
        Self::Because(text)
    }
}

impl From<&str> for Refusal {
    fn from(text: &str) -> Self {
        Self::Because(text.to_owned())
    }
}

/// Times its limit that a size is counted to.
pub(crate) const FARTHEST: u64 = 8;

/// Number of bytes that `unpacked` gives, of which the first `limit` are added to `into`; none if there are more than
/// `farthest`.
///
/// # Errors
/// Those of the reader.
pub(crate) fn unpack(
    mut unpacked: impl Read,
    limit: u64,
    farthest: u64,
    into: &mut Vec<u8>,
) -> io::Result<Option<u64>> {
    let before = into.len();
    let mut block = [0; 1 << 12];
    let mut first = (&mut unpacked).take(limit);
    loop {
        let count = first.read(&mut block)?;
        if count == 0 {
            break;
        }
        if into.capacity() - into.len() < count {
            // By a quarter: what grows is there twice while it is copied.
            into.reserve_exact(count + into.len() / 4);
        }
        into.extend_from_slice(&block[..count]);
    }
    let kept = (into.len() - before) as u64;
    let left = farthest.saturating_sub(kept);
    let more = io::copy(&mut unpacked.take(left.saturating_add(1)), &mut io::sink())?;
    Ok((more <= left).then_some(kept + more))
}

/// Space for numbers and for parts of structs, which are counted before they are stored.
pub(crate) struct Space {
    limit: u64,
    used: u64,
    parts: usize,
}

impl Space {
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, used: 0, parts: MOST_ARRAYS }
    }

    /// Whether there is space for more numbers.
    pub(super) fn has(&mut self, numbers: usize) -> bool {
        self.used = self.used.saturating_add((numbers as u64).saturating_mul(8));
        self.used <= self.limit
    }

    /// Takes the space for parts of a struct: names of fields, or values. Takes none if there is not enough.
    pub(super) fn take_parts(&mut self, count: usize) -> bool {
        let left = self.parts.checked_sub(count);
        self.parts = left.unwrap_or(self.parts);
        left.is_some()
    }

    /// An error if there was not enough.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if self.used > self.limit { Err(Refusal::Large(Some(self.used))) } else { Ok(()) }
    }
}

/// Form of numbers: integers with (`i`) or without (`u`) sign, or floating point (`f`), of a number of bytes each.
pub(super) type Form = (char, usize);

/// From here on a number need not be the integer that it was read from: 2⁵³.
pub(super) const INEXACT: f64 = 9_007_199_254_740_992.0;

/// The rest of a file or of a part of it.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub(super) rest: &'a [u8],
    pub(super) is_big_endian: bool,
}

impl<'a> Bytes<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(DAMAGED)?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = *self.take(N)?.first_chunk().ok_or(DAMAGED)?;
        if self.is_big_endian {
            array.reverse();
        }
        Ok(array)
    }

    pub(super) fn word(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    /// A 64-bit number of bytes or values.
    pub(super) fn count(&mut self) -> Result<usize, String> {
        usize::try_from(u64::from_le_bytes(self.array()?)).map_err(|_| DAMAGED.to_owned())
    }

    /// The rest as numbers of this form.
    pub(super) fn numbers(self, form: Form) -> Vec<f64> {
        let mut values = Vec::new();
        self.append_numbers(form, &mut values);
        values
    }

    /// Appends the rest as numbers of this form.
    pub(super) fn append_numbers(self, form: Form, into: &mut Vec<f64>) {
        macro_rules! numbers {
            ($type:ty) => {{
                let (values, _) = self.rest.as_chunks();
                let read = if self.is_big_endian { <$type>::from_be_bytes } else { <$type>::from_le_bytes };
                into.extend(values.iter().map(|value| read(*value) as f64));
            }};
        }
        match form {
            ('i', 1) => numbers!(i8),
            ('i', 2) => numbers!(i16),
            ('i', 4) => numbers!(i32),
            ('i', 8) => numbers!(i64),
            ('u', 1) => numbers!(u8),
            ('u', 2) => numbers!(u16),
            ('u', 4) => numbers!(u32),
            ('u', 8) => numbers!(u64),
            ('f', 4) => numbers!(f32),
            ('f', 8) => numbers!(f64),
            _ => {}
        }
    }
}
