//! Run-to-run adaptation of one leg: EWMA and PCC in the filter form of Fig. 5 with Ĝ_p = ρ̂.
//!
//! ```text
//! m_n = Y_n − ρ̂ X_n                                                      model error of run n, (AII.1)
//! EWMA:  δ̂_n = ω m_n + (1−ω) δ̂_{n−1}                                      (AII.3)
//! PCC:   δ̂_n = ω1 m_n + (1−ω1) δ̂_{n−1}                                    (AII.5)
//!        φ̂_n = ω2 (m_n − δ̂_{n−1}) + (1−ω2) φ̂_{n−1}                       (AII.6), with the old δ̂
//! next request: ρ̂ X_{n+1} = T_{n+1} − δ̂_n − φ̂_n                          (AII.2), (AII.4)
//! ```
//! ρ̂ X is the displacement requested after all limits: that is the anti-windup. The integrator form (AII.7)–(AII.13)
//! belongs to another error (Y − Ŷ); it must not be fed with m.
//!
//! # Example
//!
//! A model error that drifts by 1 nm a run. At a weight of 1/2, EWMA is 2 nm behind the next run; φ̂ of PCC supplies
//! them:
//!
//! ```
//! use specgen_runtime::{Estimate, Law};
//!
//! let (mut ewma, mut pcc) = (Estimate::<f64>::new(), Estimate::<f64>::new());
//! for run in 0..=60 {
//!     ewma.update(Law::Ewma, 0.5, 0.0, f64::from(run));
//!     pcc.update(Law::Pcc, 0.5, 0.5, f64::from(run));
//! }
//! // The error of run 61 will be 61 nm.
//! assert!((ewma.correction() - 59.0).abs() < 1e-9);
//! assert!((pcc.correction() - 61.0).abs() < 1e-9);
//! ```

use crate::choice::choice;
use crate::real::Real;

choice! {
    /// Estimates in use.
    pub enum Law {
        /// None: inverse Preisach model alone.
        Invhys = 0 => "invhys",
        /// δ̂ by (AII.3).
        Ewma = 1 => "ewma",
        /// δ̂ and φ̂ by (AII.5) and (AII.6).
        Pcc = 2 => "pcc",
    }
}

crate::state! { |words|
    /// Estimates of one leg, m. Zero at reset.
    pub struct Estimate<T>[T: Real] {
        /// δ̂: offset between the leg and its model.
        pub level: T = T::ZERO, number(words.sizes().request);
        /// φ̂: the lag of δ̂ behind a drifting offset; zero under EWMA.
        pub drift: T = T::ZERO, number(words.sizes().request);
    }
}

impl<T: Real> Estimate<T> {
    /// Displacement to subtract from the demand before the inverse, δ̂ + φ̂, m.
    #[inline]
    #[must_use]
    pub fn correction(&self) -> T {
        self.level + self.drift
    }

    /// End of a run: `model_error` is m = Y − ρ̂X (m, finite), the weights are per run and within (0, 1].
    #[inline]
    pub fn update(&mut self, law: Law, level_weight: T, drift_weight: T, model_error: T) {
        let old_level = self.level;
        match law {
            Law::Invhys => *self = Self::new(),
            Law::Ewma => {
                self.level = level_weight * model_error + (T::ONE - level_weight) * old_level;
                self.drift = T::ZERO;
            }
            Law::Pcc => {
                self.level = level_weight * model_error + (T::ONE - level_weight) * old_level;
                self.drift = drift_weight * (model_error - old_level) + (T::ONE - drift_weight) * self.drift;
            }
        }
    }

    /// The same law for six, with the innovation ν = m − δ̂ − φ̂ in place of m, so that ν can be filtered (the modal
    /// notch): δ̂ ← δ̂ + ω1 (ν + φ̂), φ̂ ← φ̂ + ω2 ν with the old φ̂ in both. Without a filter it equals
    /// [`Estimate::update`]. The six may be legs, or other coordinates linear in them.
    ///
    /// With the filter some permitted weights are unstable. Both estimates are limited to ±1: they stay finite at any
    /// weights and recover at once under stable ones.
    #[inline]
    pub fn correct(estimates: &mut [Self; 6], law: Law, level_weight: T, drift_weight: T, innovation: &[T; 6]) {
        let mut size = T::ZERO;
        match law {
            Law::Invhys => *estimates = [Self::new(); 6],
            Law::Ewma => {
                for (estimate, innovation) in estimates.iter_mut().zip(innovation) {
                    let level = estimate.level + level_weight * *innovation;
                    *estimate = Self { level, drift: T::ZERO };
                    size = size + level.abs();
                }
            }
            Law::Pcc => {
                for (estimate, innovation) in estimates.iter_mut().zip(innovation) {
                    let level = estimate.level + level_weight * (*innovation + estimate.drift);
                    let drift = estimate.drift + drift_weight * *innovation;
                    *estimate = Self { level, drift };
                    size = size + level.abs() + drift.abs();
                }
            }
        }
        // If the sum is within the bound, so is each term. One comparison checks all.
        if size <= T::ONE {
            return;
        }
        for estimate in estimates {
            *estimate = Self { level: bounded(estimate.level), drift: bounded(estimate.drift) };
        }
    }
}

/// Limits to ±1, far beyond any leg in m or in modal coordinates.
#[inline]
fn bounded<T: Real>(estimate: T) -> T {
    if estimate.abs() <= T::ONE {
        estimate
    } else if estimate > T::ZERO {
        T::ONE
    } else {
        -T::ONE
    }
}
