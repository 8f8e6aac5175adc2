//! Modal notch: six biquads, one for each mode of the platform, in modal coordinates.
//!
//! With V from K v = ω² M v (V⁻¹ takes a pose apart into modes), section i is the discrete form of
//!
//! ```text
//! (s² + 2 ζ_i ω_i s + ω_i²) / (s² + 2 ζ_d ω_i s + ω_i²)
//! ```
//! It takes the resonance out of the feedback, so that integral action and adaptation may be fast; it passes slow signals
//! unchanged (DC gain 1). It stands in the feedback only, never in the set-point. It does not damp the platform.

use crate::digest::Digest;
use crate::linear::transform;
use crate::real::Real;

/// Coefficients of H(z) = (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²).
#[derive(Debug, Clone, Copy)]
pub struct Section<T> {
    /// b₀, b₁, b₂.
    pub b: [T; 3],
    /// a₁, a₂.
    pub a: [T; 2],
}

/// What the six sections remember: transposed direct form II. Zero at reset.
#[derive(Debug, Clone, Copy)]
pub struct NotchState<T> {
    delays: [[T; 2]; 6],
}

impl<T: Real> Default for NotchState<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> NotchState<T> {
    /// At rest at zero.
    #[must_use]
    pub const fn new() -> Self {
        Self { delays: [[T::ZERO; 2]; 6] }
    }

    /// One tick: `into` · sections · `from` applied to `signal`.
    ///
    /// `from` takes the signal to modal coordinates (V⁻¹ for a pose, V⁻¹J⁻¹ for leg displacements), `into` brings it back.
    #[inline]
    #[must_use]
    pub fn filter(
        &mut self,
        sections: &[Section<T>; 6],
        from: &[[T; 6]; 6],
        into: &[[T; 6]; 6],
        signal: &[T; 6],
    ) -> [T; 6] {
        let mut modal = transform(from, signal);
        for ((value, section), [first, second]) in modal.iter_mut().zip(sections).zip(&mut self.delays) {
            let input = *value;
            let output = section.b[0] * input + *first;
            *first = section.b[1] * input - section.a[0] * output + *second;
            *second = section.b[2] * input - section.a[1] * output;
            *value = output;
        }
        transform(into, &modal)
    }

    /// Adds what is remembered to a digest.
    pub fn digest(&self, digest: &mut Digest) {
        for [first, second] in &self.delays {
            digest.real(*first);
            digest.real(*second);
        }
    }
}
