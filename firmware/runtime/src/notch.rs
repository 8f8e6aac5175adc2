//! Modal notch: six second-order sections, one for each mode of the platform, in modal coordinates.
//!
//! With V from K v = ω² M v (V⁻¹ takes a pose apart into modes), section i is the discrete form of
//!
//! ```text
//! (s² + 2 ζ_i ω_i s + ω_i²) / (s² + 2 ζ_d ω_i s + ω_i²)
//! ```
//! It removes the resonance from the feedback, so that integral action and adaptation may be fast. Slow signals pass
//! unchanged (DC gain 1). It filters the feedback only, never the set-point. It does not damp the platform.
//!
//! # Example
//!
//! A section with g = 1/2 and a₁ = a₂ = 0 is H(z) = (1 + z⁻²)/2. It removes a mode at a quarter of the tick rate and
//! passes what is slow:
//!
//! ```
//! use specgen_runtime::{NotchState, Section};
//!
//! let sections = [Section { depth: 0.5, a: [0.0, 0.0] }; 6];
//! let mut ringing = NotchState::<f64>::new();
//! let out = [1.0, 0.0, -1.0, 0.0, 1.0].map(|value| ringing.filter(&sections, &[value; 6])[0]);
//! assert_eq!(out, [0.5, 0.0, 0.0, 0.0, 0.0]);
//! let mut still = NotchState::<f64>::new();
//! let out = [1.0, 1.0, 1.0, 1.0].map(|value| still.filter(&sections, &[value; 6])[0]);
//! assert_eq!(out, [0.5, 0.5, 1.0, 1.0]);
//! ```

use crate::real::Real;

/// H(z) = 1 − g (1 − z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²): the bilinear transform of the notch. At z = 1 it is 1 for any rounding
/// of g, a₁ and a₂.
#[derive(Debug, Clone, Copy)]
pub struct Section<T> {
    /// g: 1 less the gain at high frequency; 0 passes everything.
    pub depth: T,
    /// a₁, a₂.
    pub a: [T; 2],
}

/// The notch of a platform.
#[derive(Debug, Clone, Copy)]
pub struct Notch<T> {
    /// One for each mode.
    pub sections: [Section<T>; 6],
    /// V⁻¹: pose to modal coordinates.
    pub pose_to_modes: [[T; 6]; 6],
    /// V: the modes as poses.
    pub modes_to_pose: [[T; 6]; 6],
}

crate::state! { |words|
    /// State of the six sections. Zero at reset.
    pub struct NotchState<T>[T: Real] {
        delays: [[T; 2]; 6] = [[T::ZERO; 2]; 6], rows(words.sizes().request);
    }
}

impl<T: Real> NotchState<T> {
    /// One tick of a signal in modal coordinates.
    #[inline]
    #[must_use]
    pub fn filter(&mut self, sections: &[Section<T>; 6], modal: &[T; 6]) -> [T; 6] {
        let mut filtered = *modal;
        for ((value, section), [first, second]) in filtered.iter_mut().zip(sections).zip(&mut self.delays) {
            // The part that is removed: a band-pass at the mode, transposed direct form II.
            let driven = section.depth * *value;
            let resonant = driven + *first;
            *value = *value - resonant;
            *first = *second - section.a[0] * resonant;
            *second = -driven - section.a[1] * resonant;
        }
        filtered
    }
}
