//! Reads the bytes of a file in sequence, and numbers from them.

/// Error message for a file that ends early.
pub(super) const DAMAGED: &str = "it is damaged or cut off";

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

    /// The rest as numbers: integers with (`i`) or without (`u`) sign, or floating point (`f`), of a number of bytes
    /// each.
    pub(super) fn numbers(self, form: (char, usize)) -> Vec<f64> {
        macro_rules! numbers {
            ($type:ty) => {{
                let (values, _) = self.rest.as_chunks();
                let read = if self.is_big_endian { <$type>::from_be_bytes } else { <$type>::from_le_bytes };
                // 64-bit counters; above 2⁵³ they are not exact.
                values.iter().map(|value| read(*value) as f64).collect()
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
            _ => Vec::new(),
        }
    }
}
