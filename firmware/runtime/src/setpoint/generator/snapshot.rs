//! The state machine of set-points as words.

use super::{Generator, Phase};
use crate::motion::Motion;
use crate::real::Real;
use crate::setpoint::profile::Profile;
use crate::setpoint::stop::Stop;
use crate::setpoint::trajectory::Cursor;
use crate::snapshot::{Choice, LARGEST, LARGEST_PLACE};

/// Most ticks that a count may hold, so that none overflows for a day.
const MOST: i32 = 1 << 30;

crate::state! {
    impl[T: Real] Generator<T>, 2 + 5 * 6 + Motion::<T>::WORDS + Profile::<T>::WORDS + 1 + Stop::<T>::WORDS + 2 + 3,
    |words| {
        phase, place, rate, target, start, goal, way, profile, tick, stop, cursor, finished, sequence, age
    } {
        words.choice(phase)?;
        match phase {
            Phase::Approach(index) | Phase::Play(index) => words.tally(index)?,
            _ => words.blank()?,
        }
        words.numbers(place, LARGEST_PLACE)?;
        words.numbers(rate, LARGEST)?;
        for pose in [start, goal, way] {
            words.numbers(pose, LARGEST_PLACE)?;
        }
        words.part(target)?;
        words.part(profile)?;
        words.ticks(tick, MOST)?;
        words.part(stop)?;
        let Cursor { part, tick } = cursor;
        words.place(part, MOST as usize)?;
        words.ticks(tick, MOST)?;
        words.choice(finished)?;
        words.tally(sequence)?;
        words.tally(age)?;
    }
}

/// The index of a trajectory is a word of its own.
impl Choice for Phase {
    fn to_word(&self) -> u64 {
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

    fn of_word(word: u64) -> Option<Self> {
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
        all.into_iter().find(|phase| phase.to_word() == word)
    }
}
