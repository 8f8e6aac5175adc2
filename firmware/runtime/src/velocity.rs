//! Rate of the measured pose: backward difference through a first-order low-pass.
//!
//! ```text
//! v_n = (1 − α) v_{n−1} + (α/T) (h_n − h_{n−1}),   α = 1 − exp(−ω_c T)
//! V(z)/H(z) = (α/T) (1 − z⁻¹) / (1 − (1 − α) z⁻¹)
//! ```
//! α makes the low-pass the exact sampled form of 1/(1 + s/ω_c). A ramp gives its slope once the initial transient has
//! decayed (e^{−ω_c t}). A slow sine gives its derivative with a delay of T/2 + (1 − α) T/α ≈ 1/ω_c. White noise of σ
//! on the pose becomes σ (α/T) √(2/(2 − α)) on the rate.
//!
//! # Example
//!
//! A ramp of 1 µm a tick, with T = 1 tick and α = 1/2. The first pose gives no rate; then the rest of the way halves:
//!
//! ```
//! use specgen_runtime::{Rate, RateFilter};
//!
//! let filter = RateFilter { keep: 0.5, gain: 0.5 };
//! let mut rate = Rate::<f64>::new();
//! let found = [10.0, 11.0, 12.0, 13.0].map(|pose| {
//!     rate.update(&filter, &[pose; 6]);
//!     rate.value()[0]
//! });
//! assert_eq!(found, [0.0, 0.5, 0.75, 0.875]);
//! ```

use crate::real::Real;

/// The filter of one controller: constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateFilter<T> {
    /// 1 − α = exp(−ω_c T), in [0, 1).
    pub keep: T,
    /// α/T, 1/s.
    pub gain: T,
}

crate::state! { |words|
    /// State of the rates of six coordinates. At rest and without a last pose at reset.
    pub struct Rate<T>[T: Real] {
        /// Last pose, m and rad.
        previous: [T; 6] = [T::ZERO; 6], axes(words.sizes().pose);
        /// Last rate, per s.
        value: [T; 6] = [T::ZERO; 6], axes(words.sizes().pose_rate);
        /// Whether there is a last pose to take a difference from.
        primed: bool = false, set;
    }
}

impl<T: Real> Rate<T> {
    /// The estimate, m/s and rad/s (rates of the three angles, not angular velocity).
    #[inline]
    #[must_use]
    pub fn value(&self) -> &[T; 6] {
        &self.value
    }

    /// Takes a new pose (finite), one period after the last call. The first one, and the first after [`Rate::coast`],
    /// gives no rate: a jump over a gap is not a rate.
    #[inline]
    pub fn update(&mut self, filter: &RateFilter<T>, pose: &[T; 6]) {
        for ((value, previous), present) in self.value.iter_mut().zip(&mut self.previous).zip(pose) {
            let step = if self.primed { *present - *previous } else { T::ZERO };
            *value = filter.keep * *value + filter.gain * step;
            *previous = *present;
        }
        self.primed = true;
    }

    /// A period without a pose: the estimate decays with the low-pass.
    #[inline]
    pub fn coast(&mut self, filter: &RateFilter<T>) {
        for value in &mut self.value {
            *value = filter.keep * *value;
        }
        self.primed = false;
    }

    /// Resets the filter while the rate is not needed. Costs almost nothing when already reset.
    #[inline]
    pub fn rest(&mut self) {
        if self.primed {
            *self = Self::new();
        }
    }
}
