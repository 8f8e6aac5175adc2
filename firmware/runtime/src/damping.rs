//! Active damping of the platform's modes: a second-order section on the error of each, in modal coordinates.
//!
//! ```text
//! d = D(z) e        D = (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²)
//! ```
//! e is V⁻¹ (h_d − h), the raw pose error of a mode, before the notch; d is the displacement of the legs that is asked for beside the
//! feedback of (7), as V⁻¹J⁻¹ of it. Near the mode D turns the phase that amplifier and sampling take, so that d is against the
//! velocity of the platform. Like k_v it is known to the model of the innovation, which does not see it.

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
    /// What the sections of `N` modes remember; zero at reset. `N` is 6, or 0 where nothing is damped, which takes neither memory nor
    /// instructions.
    pub struct Damping<T, N>[T: Real, const N: usize] {
        /// d of each mode over the interval now running, m and rad in modal coordinates.
        pub asked: [T; N] = [T::ZERO; N], numbers(words.sizes().request);
        delays: [[T; 2]; N] = [[T::ZERO; 2]; N], rows(words.sizes().request);
    }
}

/// Active damping of six modes, or of none: what it remembers.
pub trait ModalDamping<T: Real>: Copy + Debug + Snapshot {
    /// A section for each mode.
    type Sections;
    /// Nothing asked for.
    const REST: Self;
    /// From now on nothing is asked for.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// One tick: the error of each mode to what is asked for against it.
    fn act(&mut self, sections: &Self::Sections, error: &[T; 6]);
    /// `wanted` and what is asked for against the modes.
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
