//! Bumpless change of mode: what the new law asks for differs from where the legs are, and the difference is faded out.

use crate::digest::Digest;
use crate::real::Real;

/// An offset on each leg's request that fades exponentially, m. Zero at reset.
#[derive(Debug, Clone, Copy)]
pub struct Transfer<T> {
    /// Offset of each leg, m.
    pub offset: [T; 6],
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
        Self { offset: [T::ZERO; 6] }
    }

    /// One tick: `keep` (in [0, 1)) of each offset is left, and none once it is below `negligible` (m, > 0), so that it
    /// ends in zero rather than in subnormal numbers.
    #[inline]
    pub fn fade(&mut self, keep: T, negligible: T) {
        for offset in &mut self.offset {
            let faded = keep * *offset;
            *offset = if faded.abs() > negligible { faded } else { T::ZERO };
        }
    }

    /// Adds the state to a digest.
    pub fn digest(&self, digest: &mut Digest) {
        for value in &self.offset {
            digest.real(*value);
        }
    }
}
