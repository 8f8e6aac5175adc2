//! The supervisor as words.

use super::{Approach, Cause, Channel, Debounce, Phase, Request, Supervisor, TIMERS, Watch};
use crate::real::Real;
use crate::snapshot::{Choice, Sizes};

/// Words of a channel.
const CHANNEL: usize = 7;

crate::state! {
    impl[T: Real] Supervisor<T>, 3 + 3 + 3 + TIMERS + 6 * CHANNEL + 6 + Approach::<T>::WORDS,
    |words| {
        phase, cause, request, fresh, wants_arming, seen, conditions, debounce, busy, ticks, watch, approach
    } {
        words.choice(phase)?;
        words.choice(cause)?;
        words.choice(request)?;
        for flag in [fresh, wants_arming, busy] {
            words.set(flag)?;
        }
        for count in [seen, conditions, ticks] {
            words.tally(count)?;
        }
        let Debounce { counts } = debounce;
        for count in counts {
            words.tally(count)?;
        }
        let Sizes { request, reading, .. } = words.sizes();
        let Watch { channels, turn, suspects, present, lasted } = watch;
        for Channel { word, known, expected, stuck, disagreed, astray } in channels {
            words.number(word, reading)?;
            words.set(known)?;
            // Displacement less the known load, which a gain may have made large.
            words.numbers(expected, request)?;
            for count in [stuck, disagreed, astray] {
                words.tally(count)?;
            }
        }
        words.place(turn, 6)?;
        for set in suspects {
            words.tally(set)?;
        }
        words.tally(present)?;
        words.tally(lasted)?;
        words.part(approach)?;
    }
}

impl Choice for Phase {
    fn to_word(&self) -> u64 {
        self.word()
    }

    fn of_word(word: u64) -> Option<Self> {
        Self::from_word(word)
    }
}

impl Choice for Cause {
    fn to_word(&self) -> u64 {
        self.word()
    }

    fn of_word(word: u64) -> Option<Self> {
        Self::from_word(word)
    }
}

impl Choice for Request {
    fn to_word(&self) -> u64 {
        self.word()
    }

    fn of_word(word: u64) -> Option<Self> {
        (word <= 5).then(|| Self::from_word(word))
    }
}
