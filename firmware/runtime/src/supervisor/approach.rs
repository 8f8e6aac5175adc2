//! Set-points of a controller without a generator, from where the legs are to where they are asked for.

use crate::digest::Digest;
use crate::real::Real;

/// How far an approach has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Done,
    /// No set-point has been accepted yet.
    Waiting,
    Fading,
}

/// An offset on the set-point that fades: at first it is where the legs are, in the end where they are asked for.
#[derive(Debug, Clone, Copy)]
pub struct Approach<T> {
    stage: Stage,
    /// Where it starts, then what is left of the way; in the coordinates of the set-point.
    offset: [T; 6],
}

impl<T: Real> Default for Approach<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Approach<T> {
    /// Set-points as they are.
    #[must_use]
    pub const fn new() -> Self {
        Self { stage: Stage::Done, offset: [T::ZERO; 6] }
    }

    /// Begins where the legs are (finite).
    #[inline]
    pub fn begin(&mut self, from: [T; 6]) {
        *self = Self { stage: Stage::Waiting, offset: from };
    }

    /// Whether set-points go through as they are.
    #[inline]
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// The set-point to give to the law for the one that is asked for. One that is not `accepted` (finite, within bounds) goes
    /// through as it is, for the law to refuse. `keep` (in [0, 1)) of the way is left after each tick, and none of what is below
    /// `negligible`.
    #[inline]
    pub fn setpoint(&mut self, asked: &[T; 6], accepted: bool, keep: T, negligible: T) -> [T; 6] {
        if self.stage == Stage::Done || !accepted {
            return *asked;
        }
        self.fade(asked, keep, negligible)
    }

    #[cold]
    #[inline(never)]
    fn fade(&mut self, asked: &[T; 6], keep: T, negligible: T) -> [T; 6] {
        let mut setpoint = *asked;
        if self.stage == Stage::Waiting {
            for (offset, asked) in self.offset.iter_mut().zip(asked) {
                *offset = *asked - *offset;
            }
        }
        self.stage = Stage::Done;
        for (value, offset) in setpoint.iter_mut().zip(&mut self.offset) {
            *value = *value - *offset;
            let faded = keep * *offset;
            let left = faded.abs() > negligible;
            *offset = if left { faded } else { T::ZERO };
            if left {
                self.stage = Stage::Fading;
            }
        }
        setpoint
    }

    /// Three words and six: the stage, and what [`Approach::from_words`] reads back.
    #[must_use]
    pub fn to_words(&self) -> [u64; 7] {
        let stage = match self.stage {
            Stage::Done => 0,
            Stage::Waiting => 1,
            Stage::Fading => 2,
        };
        let mut words = [stage; 7];
        for (word, offset) in words.iter_mut().skip(1).zip(&self.offset) {
            *word = offset.to_word();
        }
        words
    }

    /// The inverse of [`Approach::to_words`]; none if a number is not finite or the stage is none.
    #[must_use]
    pub fn from_words(words: &[u64; 7]) -> Option<Self> {
        let stage = match words[0] {
            0 => Stage::Done,
            1 => Stage::Waiting,
            2 => Stage::Fading,
            _ => return None,
        };
        let mut offset = [T::ZERO; 6];
        for (value, word) in offset.iter_mut().zip(words.iter().skip(1)) {
            *value = T::from_word(*word);
            if !value.is_finite() {
                return None;
            }
        }
        Some(Self { stage, offset })
    }

    /// Adds the state to a digest.
    pub fn digest(&self, digest: &mut Digest) {
        for word in self.to_words() {
            digest.word(word);
        }
    }
}
