//! Bytes of a file, one part after the other, and the numbers that they are.

/// Why nothing more is read.
pub(super) const DAMAGED: &str = "it is damaged or cut off";

/// What is left of a file or a part of one.
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

    /// A number of 64 bits that counts bytes or values.
    pub(super) fn count(&mut self) -> Result<usize, String> {
        usize::try_from(u64::from_le_bytes(self.array()?)).map_err(|_| DAMAGED.to_owned())
    }

    /// All that is left, as numbers: integers with (`i`) or without (`u`) a sign, or `f`, of so many bytes each.
    pub(super) fn numbers(self, form: (char, usize)) -> Vec<f64> {
        macro_rules! numbers {
            ($type:ty) => {{
                let (values, _) = self.rest.as_chunks();
                let read = if self.is_big_endian { <$type>::from_be_bytes } else { <$type>::from_le_bytes };
                // Counters of 64 bits; beyond 2⁵³ none is exact.
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
