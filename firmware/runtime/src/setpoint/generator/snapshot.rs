//! The state machine of set-points as words.

use super::{Generator, Phase};
use crate::real::Real;
use crate::setpoint::profile::Profile;
use crate::setpoint::stop::Stop;
use crate::setpoint::trajectory::Cursor;
use crate::snapshot::{Invalid, LARGEST, LARGEST_PLACE, Reader, Snapshot, Writer};

/// Most ticks that a count may hold, so that none overflows for a day.
const MOST: i32 = 1 << 30;

impl<T: Real> Snapshot for Generator<T> {
    const WORDS: usize =
        2 + 5 * 6 + <crate::motion::Motion<T> as Snapshot>::WORDS + Profile::<T>::WORDS + 1 + Stop::<T>::WORDS + 2 + 3;

    fn save(&self, words: &mut Writer<'_>) {
        let (phase, index) = match self.phase {
            Phase::Reset => (0, 0),
            Phase::Bias => (1, 0),
            Phase::Hold => (2, 0),
            Phase::Stream => (3, 0),
            Phase::Move => (4, 0),
            Phase::Approach(index) => (5, index),
            Phase::Play(index) => (6, index),
            Phase::Stop => (7, 0),
        };
        words.word(phase);
        words.word(u64::from(index));
        for six in [&self.place, &self.rate, &self.start, &self.goal, &self.way] {
            words.reals(six);
        }
        self.target.save(words);
        self.profile.save(words);
        words.word(u64::from(self.tick as u32));
        self.stop.save(words);
        words.word(self.cursor.part as u64);
        words.word(u64::from(self.cursor.tick as u32));
        words.word(self.finished.map_or(u64::MAX, u64::from));
        words.word(u64::from(self.sequence));
        words.word(u64::from(self.age));
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        let phase = words.word(7)?;
        let index = words.counter()?;
        self.phase = match phase {
            0 => Phase::Reset,
            1 => Phase::Bias,
            2 => Phase::Hold,
            3 => Phase::Stream,
            4 => Phase::Move,
            5 => Phase::Approach(index),
            6 => Phase::Play(index),
            _ => Phase::Stop,
        };
        for (six, largest) in [
            (&mut self.place, LARGEST_PLACE),
            (&mut self.rate, LARGEST),
            (&mut self.start, LARGEST_PLACE),
            (&mut self.goal, LARGEST_PLACE),
            (&mut self.way, LARGEST_PLACE),
        ] {
            words.reals(six, largest)?;
        }
        self.target.restore(words)?;
        self.profile.restore(words)?;
        self.tick = words.count_to(MOST)?;
        self.stop.restore(words)?;
        let (part, tick) = (words.count_to(MOST)?, words.count_to(MOST)?);
        self.cursor = Cursor { part: part as usize, tick };
        self.finished = match words.word(u64::MAX)? {
            u64::MAX => None,
            index if index <= u64::from(u32::MAX) => Some(index as u32),
            _ => return Err(words.refused()),
        };
        self.sequence = words.counter()?;
        self.age = words.counter()?;
        Ok(())
    }
}
