//! A correction of the request that is given from outside, tick by tick: learned in earlier passes of a motion that repeats, or
//! prepared for one that is known.
//!
//! ```text
//! q ← q + J c        c: pose, m and rad; |c| ≤ most, and from tick to tick |Δc| ≤ step, axis by axis
//! ```
//! It is no set-point: the error (7) is still that of h_d, and the innovation does not see it. What is not a number asks for none; what is
//! larger or faster than it may be is followed as far as the limits let it, so that it fades in and out without a bump.

use core::fmt::Debug;

use crate::real::{Real, saturate};
use crate::snapshot::Snapshot;

/// How far and how fast the correction of an axis goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionLimit<T> {
    /// Largest magnitude, m or rad.
    pub most: T,
    /// Largest change in a tick, m or rad.
    pub step: T,
}

crate::state! { |words|
    /// The correction now at work on `N` axes; zero at reset. `N` is 6, or 0 where a controller takes none, which costs neither memory nor
    /// instructions.
    pub struct Correction<T, N>[T: Real, const N: usize] {
        /// c over the interval now running, m and rad.
        pub given: [T; N] = [T::ZERO; N], numbers(words.sizes().request);
    }
}

/// Correction of the request on six axes, or on none.
pub trait RequestCorrection<T: Real>: Copy + Debug + Snapshot {
    /// How far and how fast that of each axis goes.
    type Limits;
    /// What is wanted of each axis.
    type Offsets: Copy + Debug + PartialEq + AsRef<[T]> + AsMut<[T]>;
    /// Nothing corrected.
    const REST: Self;
    /// From now on nothing is corrected.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// Nothing wanted of as many axes as have limits.
    fn nothing(limits: &Self::Limits) -> Self::Offsets;
    /// One tick: follows what is wanted as far as the limits let it. Returns whether they held any axis back.
    fn follow(&mut self, limits: &Self::Limits, wanted: &Self::Offsets) -> bool;
    /// c as a pose; none where there is none.
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
