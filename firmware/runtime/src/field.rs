//! How many words the parts of a state take.

use crate::choice::Choice;

/// What a state is made of: numbers, flags, choices, arrays of them, and other states.
pub trait Field {
    /// Words that it takes.
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
