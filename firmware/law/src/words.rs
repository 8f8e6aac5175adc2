//! Numbers as 64-bit words and names of words: what inputs, outputs and settings have in common.

use core::fmt::Debug;

use specgen_runtime::snapshot::Writer;
use specgen_runtime::{CodeLimits, Real};

/// `[u64; N]` of a length that a spec decides.
pub trait WordArray: Copy + Debug + PartialEq + AsRef<[u64]> + AsMut<[u64]> {
    /// Zeros.
    const ZERO: Self;
}

impl<const N: usize> WordArray for [u64; N] {
    const ZERO: Self = [0; N];
}

/// Names of single words, of vectors (`name[0]` to `name[5]` each), and of single words again.
macro_rules! names {
    ($($first:literal),*; $($vector:literal),*; $($last:literal),*) => {
        [
            $($first,)*
            $(
                concat!($vector, "[0]"),
                concat!($vector, "[1]"),
                concat!($vector, "[2]"),
                concat!($vector, "[3]"),
                concat!($vector, "[4]"),
                concat!($vector, "[5]"),
            )*
            $($last,)*
        ]
    };
}
pub(crate) use names;

/// Six numbers from the word `first` on; zero beyond the end.
#[must_use]
pub fn six<T: Real>(words: &[u64], first: usize) -> [T; 6] {
    let mut vector = [T::ZERO; 6];
    fill(&mut vector, words, first);
    vector
}

/// Numbers from the word `first` on; those beyond the end are left.
pub(crate) fn fill<T: Real>(vector: &mut [T], words: &[u64], first: usize) {
    for (value, word) in vector.iter_mut().zip(words.iter().skip(first)) {
        *value = T::from_word(*word);
    }
}

/// The word of that number; zero beyond the end.
pub(crate) fn word(words: &[u64], number: usize) -> u64 {
    words.get(number).copied().unwrap_or(0)
}

/// Voltage limits and slew limit from the word `first` on.
pub(crate) fn code_limits(words: &[u64], first: usize) -> CodeLimits {
    let [max_step, min, max] = [0, 1, 2].map(|place| word(words, first + place) as i32);
    CodeLimits { max_step, min, max }
}

/// Writes what [`code_limits`] reads.
pub(crate) fn save_code_limits(&CodeLimits { max_step, min, max }: &CodeLimits, words: &mut Writer<'_>) {
    for code in [max_step, min, max] {
        words.word(code as u32 as u64);
    }
}
