//! Active damping of the platform's modes: a second-order section on the error of each, in modal coordinates.
//!
//! ```text
//! d = D(z) e        D = (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²)
//! ```
//! e is V⁻¹ (h_d − h), the raw pose error of a mode, before the notch. d is a displacement of the legs that is added to
//! the feedback of (7), as V⁻¹J⁻¹ of it. Near the mode, D compensates the phase lag of amplifier and sampling, so that
//! d opposes the velocity of the platform. As with k_v, the innovation does not see it.
//!
//! # Example
//!
//! The simplest D is a difference, 1 − z⁻¹: a request in proportion to the rate of the error, beside that of the
//! feedback.
//!
//! ```
//! use specgen_runtime::{Damping, ModalDamping, Resonator};
//!
//! let sections = [Resonator { b: [1.0, -1.0, 0.0], a: [0.0, 0.0] }; 6];
//! let mut damping = Damping::<f64, 6>::new();
//! damping.act(&sections, &[2.0; 6]);
//! damping.act(&sections, &[5.0; 6]);
//! assert_eq!(damping.asked, [3.0; 6]); // 5 − 2
//! assert_eq!(damping.beside([10.0; 6]), [13.0; 6]);
//! ```

use core::fmt::Debug;

use crate::real::Real;
use crate::snapshot::Snapshot;

/// D of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonator<T> {
    /// b₀, b₁, b₂.
    pub b: [T; 3],
    /// a₁, a₂.
    pub a: [T; 2],
}

crate::state! { |words|
    /// State of the sections of `N` modes; zero at reset. `N` is 6, or 0 without damping, which then costs no memory
    /// and no instructions.
    pub struct Damping<T, N>[T: Real, const N: usize] {
        /// d of each mode over the present interval, m and rad in modal coordinates.
        pub asked: [T; N] = [T::ZERO; N], numbers(words.sizes().request);
        delays: [[T; 2]; N] = [[T::ZERO; 2]; N], rows(words.sizes().request);
    }
}

/// Active damping of six modes, or of none.
pub trait ModalDamping<T: Real>: Copy + Debug + Snapshot {
    /// A section for each mode.
    type Sections;
    /// No request.
    const REST: Self;
    /// Resets the damping to zero.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// One tick: from the error of each mode to its damping request.
    fn act(&mut self, sections: &Self::Sections, error: &[T; 6]);
    /// `wanted` plus the damping request.
    #[must_use]
    fn beside(&self, wanted: [T; 6]) -> [T; 6];
}

impl<T: Real + Debug, const N: usize> ModalDamping<T> for Damping<T, N> {
    type Sections = [Resonator<T>; N];
    const REST: Self = Self::new();

    #[inline]
    fn act(&mut self, sections: &[Resonator<T>; N], error: &[T; 6]) {
        let states = self.asked.iter_mut().zip(&mut self.delays);
        for ((section, error), (asked, [first, second])) in sections.iter().zip(error).zip(states) {
            // Transposed direct form II.
            let out = section.b[0] * *error + *first;
            *first = section.b[1] * *error - section.a[0] * out + *second;
            *second = section.b[2] * *error - section.a[1] * out;
            *asked = out;
        }
    }

    #[inline]
    fn beside(&self, wanted: [T; 6]) -> [T; 6] {
        let mut sum = wanted;
        for (sum, asked) in sum.iter_mut().zip(&self.asked) {
            *sum = *sum + *asked;
        }
        sum
    }
}
