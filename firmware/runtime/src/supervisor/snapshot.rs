//! The supervisor as words.

use super::{Approach, Cause, Channel, Debounce, Phase, Request, Supervisor, TIMERS, Watch};
use crate::real::Real;
use crate::snapshot::{Invalid, LARGEST_PLACE, Reader, Sizes, Snapshot, Writer};

/// Words of a channel.
const CHANNEL: usize = 7;
/// Words of the way to a set-point.
const APPROACH: usize = 7;

impl<T: Real> Snapshot for Supervisor<T> {
    const WORDS: usize = 3 + 3 + 3 + TIMERS + 6 * CHANNEL + 6 + APPROACH;

    fn save(&self, words: &mut Writer<'_>) {
        // By name and all of them, so that a field that is added is not forgotten.
        let Self {
            phase,
            cause,
            request,
            fresh,
            wants_arming,
            seen,
            conditions,
            debounce: Debounce { counts },
            busy,
            ticks,
            watch: Watch { channels, turn, suspects, present, lasted },
            approach,
        } = self;
        for word in [phase.word(), cause.word(), request.word()] {
            words.word(word);
        }
        for set in [*fresh, *wants_arming, *busy] {
            words.flag(set);
        }
        for word in [*seen, *conditions, *ticks].iter().chain(counts) {
            words.word(u64::from(*word));
        }
        for Channel { word, known, expected, stuck, disagreed, astray } in channels {
            words.real(*word);
            words.flag(*known);
            words.reals(expected);
            for count in [*stuck, *disagreed, *astray] {
                words.word(u64::from(count));
            }
        }
        words.word(*turn as u64);
        for word in suspects.iter().chain([present, lasted]) {
            words.word(u64::from(*word));
        }
        for word in approach.to_words() {
            words.word(word);
        }
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        self.phase = Phase::from_word(words.word(u64::MAX)?).ok_or(words.refused())?;
        self.cause = Cause::from_word(words.word(u64::MAX)?).ok_or(words.refused())?;
        self.request = Request::from_word(words.word(5)?);
        for set in [&mut self.fresh, &mut self.wants_arming, &mut self.busy] {
            *set = words.flag()?;
        }
        for word in [&mut self.seen, &mut self.conditions, &mut self.ticks].into_iter().chain(&mut self.debounce.counts)
        {
            *word = words.counter()?;
        }
        let Sizes { request, reading, .. } = words.sizes();
        for channel in &mut self.watch.channels {
            channel.word = words.real(reading)?;
            channel.known = words.flag()?;
            // Displacement less the known load, which a gain may have made large.
            words.reals(&mut channel.expected, request)?;
            for count in [&mut channel.stuck, &mut channel.disagreed, &mut channel.astray] {
                *count = words.counter()?;
            }
        }
        self.watch.turn = words.word(6)? as usize;
        let Watch { suspects, present, lasted, .. } = &mut self.watch;
        for word in suspects.iter_mut().chain([present, lasted]) {
            *word = words.counter()?;
        }
        let mut approach = [0; APPROACH];
        for (index, slot) in approach.iter_mut().enumerate() {
            // Checked like any other number, whose size it does not look at itself.
            *slot = if index == 0 { words.word(2)? } else { words.real::<T>(LARGEST_PLACE)?.to_word() };
        }
        self.approach = Approach::from_words(&approach).ok_or(words.refused())?;
        Ok(())
    }
}
