//! Permitted ranges of settings: the rows of the table that the compiler writes from the spec.

use crate::real::Real;

/// The range of one word of the settings, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PermittedRange<T> {
    /// A choice, a count or a code.
    Whole(u64, u64),
    /// A number.
    Number(T, T),
}

impl<T: Real> PermittedRange<T> {
    /// The range of the setting at index `place`. Each row of the table holds for a number of settings. None beyond the
    /// last row.
    #[must_use]
    pub fn of(table: &[(Self, usize)], place: usize) -> Option<&Self> {
        let mut end = 0;
        for (permitted, settings) in table {
            end += *settings;
            if place < end {
                return Some(permitted);
            }
        }
        None
    }

    /// Whether a setting may have this word.
    #[inline]
    #[must_use]
    pub fn takes(&self, word: u64) -> bool {
        match *self {
            Self::Whole(least, most) => least <= word && word <= most,
            Self::Number(least, most) => {
                let value = T::from_word(word);
                // A NaN fails the comparison. Bits above those of an `f32` do not survive the conversion.
                least <= value && value <= most && value.to_word() == word
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::PermittedRange;

    #[test]
    fn the_ends_are_taken_and_what_is_beyond_or_no_number_is_not() {
        let codes = PermittedRange::<f64>::Whole(1, 1747);
        assert_eq!([0, 1, 1747, 1748, u64::MAX].map(|word| codes.takes(word)), [false, true, true, false, false]);
        let weight = PermittedRange::Number(0.0_f32, 1.0);
        for (value, taken) in [(0.0_f32, true), (1.0, true), (-1e-9, false), (1.0001, false), (f32::NAN, false)] {
            assert_eq!(weight.takes(u64::from(value.to_bits())), taken, "{value}");
        }
        assert!(!weight.takes(u64::from(0.5_f32.to_bits()) | 1 << 32));
        // −0 compares as within [0, 1], and keeps its sign.
        assert!(weight.takes(u64::from((-0.0_f32).to_bits())));
    }
}
