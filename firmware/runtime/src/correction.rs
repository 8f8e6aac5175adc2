//! A correction of the request from outside, tick by tick: learned in earlier passes of a repeated motion, or prepared
//! for a known one.
//!
//! ```text
//! q ← q + J c        c: pose, m and rad; |c| ≤ most, and from tick to tick |Δc| ≤ step, axis by axis
//! ```
//! It is not a set-point: the error (7) is still that of h_d, and the innovation does not see it. A value that is not
//! finite counts as zero. A value that is too large or too fast is followed up to the limits, so that the correction
//! fades in and out without a bump.
//!
//! # Example
//!
//! A request of 10 nm at limits of 4 nm, and 3 nm a tick:
//!
//! ```
//! use specgen_runtime::{Correction, CorrectionLimit, RequestCorrection};
//!
//! let limits = [CorrectionLimit { most: 4.0, step: 3.0 }; 6];
//! let mut correction = Correction::<f64, 6>::new();
//! assert!(correction.follow(&limits, &[10.0; 6])); // held back
//! assert_eq!(correction.given, [3.0; 6]);
//! assert!(correction.follow(&limits, &[10.0; 6]));
//! assert_eq!(correction.given, [4.0; 6]);
//! // Not a number counts as zero.
//! correction.follow(&limits, &[f64::NAN; 6]);
//! assert_eq!(correction.given, [1.0; 6]);
//! ```

use core::fmt::Debug;

use crate::real::{Real, saturate};
use crate::snapshot::Snapshot;

/// Limits of an axis's correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionLimit<T> {
    /// Largest magnitude, m or rad.
    pub most: T,
    /// Largest change in a tick, m or rad.
    pub step: T,
}

crate::state! { |words|
    /// The present correction of `N` axes; zero at reset. `N` is 6, or 0 for a controller without corrections, which
    /// then costs no memory and no instructions.
    pub struct Correction<T, N>[T: Real, const N: usize] {
        /// c over the interval now running, m and rad.
        pub given: [T; N] = [T::ZERO; N], numbers(words.sizes().request);
    }
}

/// Correction of the request on six axes, or on none.
pub trait RequestCorrection<T: Real>: Copy + Debug + Snapshot {
    /// Limits of the axes.
    type Limits;
    /// Requested correction of the axes.
    type Offsets: Copy + Debug + PartialEq + AsRef<[T]> + AsMut<[T]>;
    /// Nothing corrected.
    const REST: Self;
    /// Removes the correction at once.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// A request of zero on every axis that has limits.
    fn nothing(limits: &Self::Limits) -> Self::Offsets;
    /// One tick: follows the request up to the limits. Returns whether a limit held an axis back.
    fn follow(&mut self, limits: &Self::Limits, wanted: &Self::Offsets) -> bool;
    /// c as a pose; none if the controller has no correction.
    #[must_use]
    fn pose(&self) -> Option<[T; 6]>;
}

impl<T: Real + Debug, const N: usize> RequestCorrection<T> for Correction<T, N> {
    type Limits = [CorrectionLimit<T>; N];
    type Offsets = [T; N];
    const REST: Self = Self::new();

    #[inline(always)]
    fn nothing(_limits: &Self::Limits) -> [T; N] {
        [T::ZERO; N]
    }

    #[inline]
    fn follow(&mut self, limits: &[CorrectionLimit<T>; N], wanted: &[T; N]) -> bool {
        let mut held_back = false;
        for ((limit, wanted), given) in limits.iter().zip(wanted).zip(&mut self.given) {
            let (low, high) = (*given - limit.step, *given + limit.step);
            // NaN fails both comparisons.
            let aim = if *wanted > limit.most {
                limit.most
            } else if *wanted >= -limit.most {
                *wanted
            } else if *wanted < -limit.most {
                -limit.most
            } else {
                T::ZERO
            };
            *given = saturate(aim, low, high);
            held_back |= *given != *wanted;
        }
        held_back
    }

    #[inline]
    fn pose(&self) -> Option<[T; 6]> {
        self.given.first_chunk().copied()
    }
}
