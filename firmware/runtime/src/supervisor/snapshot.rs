//! The supervisor as words.

use super::{Cause, Phase, Request, Supervisor};
use crate::real::Real;
use crate::snapshot::{Invalid, LARGEST_PLACE, Reader, Snapshot, Writer};

impl<T: Real> Snapshot for Supervisor<T> {
    const WORDS: usize = 3 + 6;

    fn save(&self, words: &mut Writer<'_>) {
        // By name and all of them, so that a field that is added is not forgotten.
        let Self { phase, cause, request, measured } = self;
        words.word(phase.word());
        words.word(cause.word());
        words.word(request.word());
        words.reals(measured);
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        self.phase = Phase::from_word(words.word(u64::MAX)?).ok_or(words.refused())?;
        self.cause = Cause::from_word(words.word(u64::MAX)?).ok_or(words.refused())?;
        self.request = Request::from_word(words.word(5)?);
        words.reals(&mut self.measured, LARGEST_PLACE)
    }
}
