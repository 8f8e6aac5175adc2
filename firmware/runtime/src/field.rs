//! Number of words of the parts of a state.

use crate::choice::Choice;

/// A part of a state: a number, a flag, a choice, an array of them, or another state.
pub trait Field {
    /// Number of words.
    const WORDS: usize;
}

macro_rules! one_word {
    ($($type:ty),+) => {
        $(impl Field for $type {
            const WORDS: usize = 1;
        })+
    };
}
one_word!(f64, f32, usize, i32, u32, bool);

impl<C: Choice> Field for C {
    const WORDS: usize = 1;
}

impl<F: Field, const N: usize> Field for [F; N] {
    const WORDS: usize = N * F::WORDS;
}
