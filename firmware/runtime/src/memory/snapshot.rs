//! The staircase as words. Only what is stored counts; the room behind it is zero.

use super::ReversalMemory;
use crate::real::Real;
use crate::snapshot::{Invalid, LARGEST, LARGEST_PLACE, Reader, Snapshot, Writer};

impl<T: Real, const CAP: usize> ReversalMemory<T, CAP> {
    /// The highest drive in memory, cells.
    #[must_use]
    pub fn highest(&self) -> T {
        // Maxima fall, and the drive is below the last of them.
        if self.len >= 2 { self.extremum(1) } else { self.drive }
    }

    /// Minima rise, maxima fall, all of them nested, the first at negative saturation, the drive within the innermost.
    fn is_staircase(&self) -> bool {
        let mut low = T::ZERO;
        let mut high = T::from_f64(LARGEST);
        let mut nested = self.extremum(0) == T::ZERO;
        for (k, extremum) in self.extrema.iter().take(self.len).enumerate() {
            nested &= low <= *extremum && *extremum <= high;
            if k % 2 == 0 { low = *extremum } else { high = *extremum }
        }
        nested && low <= self.drive && self.drive <= high
    }
}

impl<T: Real, const CAP: usize> Snapshot for ReversalMemory<T, CAP> {
    const WORDS: usize = 4 + 2 * CAP;

    fn save(&self, words: &mut Writer<'_>) {
        words.word(self.len as u64);
        words.word(u64::from(self.dropped));
        words.real(self.drive);
        words.real(self.displacement);
        words.first_reals(&self.extrema, self.len);
        words.first_reals(&self.displacements, self.len);
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        self.len = words.word(CAP as u64)? as usize;
        if self.len == 0 {
            return Err(words.refused());
        }
        self.dropped = words.counter()?;
        self.drive = words.real(LARGEST)?;
        self.displacement = words.real(LARGEST_PLACE)?;
        words.reals(&mut self.extrema, LARGEST)?;
        if !self.is_staircase() {
            return Err(words.refused());
        }
        words.reals(&mut self.displacements, LARGEST_PLACE)
    }
}
