//! The deflection of the legs to first order about rest.

use crate::linear::{each, transform};
use crate::motion::Motion;
use crate::real::Real;

/// p = P h + Q ḧ: deflection of the legs by inertia and gravity, relative to that at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine<T> {
    /// P, a row by leg, m/m and m/rad.
    pub pose: [[T; 6]; 6],
    /// Q, a row by leg, m/(m/s²) and m/(rad/s²).
    pub acceleration: [[T; 6]; 6],
}

impl<T: Real> Affine<T> {
    /// p of each leg, m.
    #[inline]
    #[must_use]
    pub fn deflection(&self, motion: &Motion<T>) -> [T; 6] {
        let (weight, inertia) =
            (transform(&self.pose, &motion.pose), transform(&self.acceleration, &motion.acceleration));
        each(|leg| weight[leg] + inertia[leg])
    }
}
