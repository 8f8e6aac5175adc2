//! The phase of the generator as words: its number, and the index of a trajectory.

use core::convert::Infallible;

use super::Phase;
use crate::snapshot::{Field, InvalidState, Reader, Snapshot, WordSink};

impl Phase {
    fn number(self) -> u64 {
        match self {
            Self::Reset => 0,
            Self::Bias => 1,
            Self::Hold => 2,
            Self::Stream => 3,
            Self::Move => 4,
            Self::Approach(_) => 5,
            Self::Play(_) => 6,
            Self::Stop => 7,
        }
    }
}

impl Field for Phase {
    const WORDS: usize = 2;
}

impl Snapshot for Phase {
    fn show(&self, words: &mut impl WordSink) -> Result<(), Infallible> {
        words.put(self.number());
        match self {
            Self::Approach(index) | Self::Play(index) => words.tally(index),
            _ => words.blank(),
        }
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState> {
        let number = words.word(u64::MAX)?;
        let all = [
            Self::Reset,
            Self::Bias,
            Self::Hold,
            Self::Stream,
            Self::Move,
            Self::Approach(0),
            Self::Play(0),
            Self::Stop,
        ];
        *self = all.into_iter().find(|phase| phase.number() == number).ok_or(words.refused())?;
        match self {
            Self::Approach(index) | Self::Play(index) => words.tally(index),
            _ => words.blank(),
        }
    }
}
