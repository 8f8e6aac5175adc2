//! The staircase as words. Only what is stored counts; the room behind it is zero.

use super::ReversalMemory;
use crate::real::Real;
use crate::snapshot::{LARGEST, LARGEST_PLACE};

impl<T: Real, const CAP: usize> ReversalMemory<T, CAP> {
    /// The highest drive in memory, cells.
    #[must_use]
    pub fn highest(&self) -> T {
        // Maxima fall, and the drive is below the last of them.
        if self.len >= 2 { self.extremum(1) } else { self.drive }
    }
}

/// Minima rise, maxima fall, all of them nested, the first at negative saturation, the drive within the innermost.
fn is_staircase<T: Real>(extrema: &[T], drive: T) -> bool {
    let mut low = T::ZERO;
    let mut high = T::from_f64(LARGEST);
    let mut nested = extrema.first() == Some(&T::ZERO);
    for (k, extremum) in extrema.iter().enumerate() {
        nested &= low <= *extremum && *extremum <= high;
        if k % 2 == 0 { low = *extremum } else { high = *extremum }
    }
    nested && low <= drive && drive <= high
}

crate::state! {
    impl[T: Real, const CAP: usize] ReversalMemory<T, CAP>, 4 + 2 * CAP,
    |words| { extrema, displacements, len, drive, displacement, dropped } {
        words.place(len, CAP)?;
        words.check(|| *len > 0)?;
        words.tally(dropped)?;
        words.number(drive, LARGEST)?;
        words.number(displacement, LARGEST_PLACE)?;
        words.stored(extrema, *len, LARGEST)?;
        words.check(|| is_staircase(extrema.get(..*len).unwrap_or_default(), *drive))?;
        words.stored(displacements, *len, LARGEST_PLACE)?;
    }
}
