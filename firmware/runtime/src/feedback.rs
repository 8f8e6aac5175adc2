//! Feedback of (7): k_p e + k_I ∫e, as a generalised force on the platform, with anti-windup.
//!
//! The integral is stored as the force it exerts (N, N m), not as ∫e, so that a change of gain is bumpless.
//!
//! # Example
//!
//! An error of 2 µm along x for one tick of 0.5 s, with k_I = 8 N/(µm s), adds 8 N. A leg at its upper limit stops an
//! integral that would push it further, but not one that leads back:
//!
//! ```
//! use specgen_runtime::feedback::{Integral, winds_up};
//!
//! let mut integral = Integral::<f64>::new();
//! integral.grow(&Integral::growth(&[8.0; 6], 0.5, &[2.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
//! assert_eq!(integral.force[0], 8.0);
//! let at_limit = [1e-6, 0.0, 0.0, 0.0, 0.0, 0.0];
//! assert!(winds_up(&at_limit, &[1e-9; 6]));
//! assert!(!winds_up(&at_limit, &[-1e-9; 6]));
//! ```

use crate::real::{Real, saturate};
use crate::snapshot::LARGEST;

/// Diagonal gains of (7): x, y, z, θx, θy, θz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains<T> {
    /// k_p, N/m and N m/rad.
    pub proportional: [T; 6],
    /// k_I, N/(m s) and N m/(rad s).
    pub integral: [T; 6],
    /// k_v, N s/m and N m s/rad.
    pub derivative: [T; 6],
}

/// `gain · error`, axis by axis.
#[inline]
#[must_use]
pub fn force_of<T: Real>(gain: &[T; 6], error: &[T; 6]) -> [T; 6] {
    let mut force = *gain;
    for (force, error) in force.iter_mut().zip(error) {
        *force = *force * *error;
    }
    force
}

crate::state! { |words|
    /// The integral part of (7), as a generalised force. Zero at reset.
    pub struct Integral<T>[T: Real] {
        /// k_I ∫e, N and N m.
        pub force: [T; 6] = [T::ZERO; 6], numbers(LARGEST);
    }
}

impl<T: Real> Integral<T> {
    /// One tick's growth T_s k_I e.
    #[inline]
    #[must_use]
    pub fn growth(gain: &[T; 6], period: T, error: &[T; 6]) -> [T; 6] {
        let mut growth = force_of(gain, error);
        for value in &mut growth {
            *value = period * *value;
        }
        growth
    }

    /// Adds a tick's growth. No force grows beyond [`LARGEST`]: with some permitted gains it would otherwise overflow.
    #[inline]
    pub fn grow(&mut self, growth: &[T; 6]) {
        let mut size = T::ZERO;
        for (force, growth) in self.force.iter_mut().zip(growth) {
            *force = *force + *growth;
            size = size + force.abs();
        }
        // If the sum is within the bound, so is each term. One comparison checks all.
        let largest = T::from_f64(LARGEST);
        if size > largest {
            self.bound(largest);
        }
    }

    #[cold]
    #[inline(never)]
    fn bound(&mut self, largest: T) {
        for force in &mut self.force {
            *force = saturate(*force, -largest, largest);
        }
    }
}

/// Whether a growth that moves the legs' requests by `push` drives a leg further beyond its active limit.
///
/// `excess` is the part of each leg's request beyond its limit (m; zero for a free leg). Growth that leads back is
/// allowed: otherwise an integral could keep a leg at its limit for ever.
#[inline]
#[must_use]
pub fn winds_up<T: Real>(excess: &[T; 6], push: &[T; 6]) -> bool {
    let mut outward = false;
    for (excess, push) in excess.iter().zip(push) {
        outward |= (*excess > T::ZERO && *push > T::ZERO) || (*excess < T::ZERO && *push < T::ZERO);
    }
    outward
}
