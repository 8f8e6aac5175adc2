//! Bumpless change of mode: the difference between the new law's request and the legs' position is faded out.
//!
//! # Example
//!
//! An offset of 8 nm that halves in each tick, until no more than 1 nm would be left:
//!
//! ```
//! use specgen_runtime::Transfer;
//!
//! let mut transfer = Transfer::<f64>::new();
//! transfer.begin([8.0; 6]);
//! let left = [(); 3].map(|()| {
//!     transfer.fade(0.5, 1.0);
//!     transfer.offset()[0]
//! });
//! assert_eq!(left, [4.0, 2.0, 0.0]);
//! assert!(!transfer.is_active());
//! ```

use crate::real::Real;

crate::state! { |words|
    /// An offset on each leg's request that fades exponentially, m. Zero at reset.
    pub struct Transfer<T>[T: Real] {
        /// Offset of each leg, m.
        offset: [T; 6] = [T::ZERO; 6], numbers(words.sizes().request);
        /// Whether any of them is left.
        active: bool = false, set;
    }
}

impl<T: Real> Transfer<T> {
    /// Starts to fade `offset` (m).
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

    /// Whether any offset is left.
    #[inline]
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// One tick: leaves the fraction `keep` (in [0, 1)) of each offset, and zero once it is below `negligible` (m, >
    /// 0), so that it does not end in subnormal numbers.
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
