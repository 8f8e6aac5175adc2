//! Bumpless change of mode: what the new law asks for differs from where the legs are, and the difference is faded out.

use crate::real::Real;

/// An offset on each leg's request that fades exponentially, m. Zero at reset.
#[derive(Debug, Clone, Copy)]
pub struct Transfer<T> {
    /// Offset of each leg, m.
    offset: [T; 6],
    /// Any of them is left.
    active: bool,
}

impl<T: Real> Default for Transfer<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Transfer<T> {
    /// Nothing to fade.
    #[must_use]
    pub const fn new() -> Self {
        Self { offset: [T::ZERO; 6], active: false }
    }

    /// Begins to fade `offset` (m).
    #[inline]
    pub fn begin(&mut self, offset: [T; 6]) {
        self.offset = offset;
        self.active = true;
    }

    /// Offset of each leg, m.
    #[inline]
    #[must_use]
    pub fn offset(&self) -> &[T; 6] {
        &self.offset
    }

    /// Any offset is left.
    #[inline]
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// One tick: `keep` (in [0, 1)) of each offset is left, and none once it is below `negligible` (m, > 0), so that it
    /// ends in zero rather than in subnormal numbers.
    #[inline]
    pub fn fade(&mut self, keep: T, negligible: T) {
        if !self.active {
            return;
        }
        self.active = false;
        for offset in &mut self.offset {
            let faded = keep * *offset;
            let left = faded.abs() > negligible;
            *offset = if left { faded } else { T::ZERO };
            self.active |= left;
        }
    }
}

crate::state! {
    impl[T: Real] Transfer<T>, 7, |words| { offset, active } {
        words.numbers(offset, words.sizes().request)?;
        words.set(active)?;
    }
}
