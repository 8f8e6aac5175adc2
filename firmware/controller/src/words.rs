// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Numbers as 64-bit words and names of words: what inputs, outputs and settings have in common.

use crate::Real;
use specgen_runtime::Real as _;

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
pub(crate) fn six(words: &[u64], first: usize) -> [Real; 6] {
    numbers(words, first)
}

/// So many numbers from the word `first` on; zero beyond the end.
pub(crate) fn numbers<const N: usize>(words: &[u64], first: usize) -> [Real; N] {
    let mut vector = [0.0; N];
    for (value, word) in vector.iter_mut().zip(words.iter().skip(first)) {
        *value = Real::from_word(*word);
    }
    vector
}
