//! A correction of the request that is given from outside, tick by tick: learned in earlier passes of a motion that repeats, or
//! prepared for one that is known.
//!
//! ```text
//! q ← q + J c        c: pose, m and rad; |c| ≤ most, and from tick to tick |Δc| ≤ step, axis by axis
//! ```
//! It is no set-point: the error (7) is still that of h_d, and the innovation does not see it. What is not a number asks for none; what is
//! larger or faster than it may be is followed as far as the limits let it, so that it fades in and out without a bump.

use crate::real::{Real, saturate};

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

impl<T: Real, const N: usize> Correction<T, N> {
    /// One tick: follows what is `wanted` as far as the limits let it. Returns whether they held any axis back.
    #[inline]
    pub fn follow(&mut self, limits: &[CorrectionLimit<T>; N], wanted: &[T; N]) -> bool {
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

    /// c as a pose; none where there is none.
    #[inline]
    #[must_use]
    pub fn pose(&self) -> Option<[T; 6]> {
        self.given.first_chunk().copied()
    }
}
