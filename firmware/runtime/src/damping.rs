//! Active damping of the platform's modes: a second-order filter on the error of each mode.
//!
//! ```text
//! d = D(z) e        D = (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²)
//! ```
//! e is the pose error of a mode before the notch, an element of V⁻¹ (h_d − h). d is a modal displacement: the legs get
//! J V d in addition to the feedback of (7). Near the mode, D compensates the phase lag of amplifier and sampling, so
//! that d opposes the velocity of the platform. The innovation does not contain d.
//!
//! # Example
//!
//! The simplest D is a difference, 1 − z⁻¹: a request in proportion to the rate of the error.
//!
//! ```
//! use specgen_runtime::{Damping, ModalDamping, Resonator};
//!
//! let sections = [Resonator { b: [1.0, -1.0, 0.0], a: [0.0, 0.0] }; 6];
//! let mut damping = Damping::<f64, 6>::new();
//! damping.update(&sections, &[2.0; 6]);
//! damping.update(&sections, &[5.0; 6]);
//! assert_eq!(damping.request, [3.0; 6]); // 5 − 2
//! assert_eq!(damping.add_to([10.0; 6]), [13.0; 6]);
//! ```

use core::fmt::Debug;

use crate::real::Real;
use crate::snapshot::Snapshot;

/// D of a mode, a biquad.
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
        pub request: [T; N] = [T::ZERO; N], numbers(words.sizes().request);
        delays: [[T; 2]; N] = [[T::ZERO; 2]; N], rows(words.sizes().request);
    }
}

/// Active damping of six modes, or of none.
pub trait ModalDamping<T: Real>: Copy + Debug + Snapshot {
    /// A biquad for each mode.
    type Sections;
    /// State at rest: no request.
    const REST: Self;
    /// Resets the damping to zero.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// One tick: computes the damping request of each mode from its error.
    fn update(&mut self, sections: &Self::Sections, error: &[T; 6]);
    /// The modal request of the feedback plus that of the damping, m and rad.
    #[must_use]
    fn add_to(&self, feedback: [T; 6]) -> [T; 6];
}

impl<T: Real + Debug, const N: usize> ModalDamping<T> for Damping<T, N> {
    type Sections = [Resonator<T>; N];
    const REST: Self = Self::new();

    #[inline]
    fn update(&mut self, sections: &[Resonator<T>; N], error: &[T; 6]) {
        let states = self.request.iter_mut().zip(&mut self.delays);
        for ((section, error), (request, [first, second])) in sections.iter().zip(error).zip(states) {
            // Transposed direct form II.
            let out = section.b[0] * *error + *first;
            *first = section.b[1] * *error - section.a[0] * out + *second;
            *second = section.b[2] * *error - section.a[1] * out;
            *request = out;
        }
    }

    #[inline]
    fn add_to(&self, feedback: [T; 6]) -> [T; 6] {
        let mut sum = feedback;
        for (sum, request) in sum.iter_mut().zip(&self.request) {
            *sum = *sum + *request;
        }
        sum
    }
}
