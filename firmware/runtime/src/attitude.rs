//! Attitude by three angles about fixed axes: R = Rz(θz) Ry(θy) Rx(θx) (AI.1), from {P} to {B}.
//!
//! The rates of the angles are not the angular velocity: ω = T(θ) θ̇ (base axes). The paper equates them. That is exact
//! only at rest; elsewhere the error is of the order of the tilt.
//!
//! Everything is built from sin θ and 1 − cos θ, so that nothing cancels for small angles. The caller chooses how to
//! compute them: [`Series`] is for angles within a declared bound.
//!
//! # Example
//!
//! A quarter turn about z has sine 1 and versine 1. R takes x to y, so R − I has −1 and 1 in its first column:
//!
//! ```
//! use specgen_runtime::Attitude;
//!
//! let quarter = Attitude::<f64> { sine: [0.0, 0.0, 1.0], versine: [0.0, 0.0, 1.0] };
//! assert_eq!(quarter.rotation_less_identity(), [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]);
//! ```

use crate::real::Real;

/// Sine and versine of the three angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude<T> {
    /// sin θx, sin θy, sin θz.
    pub sine: [T; 3],
    /// 1 − cos θx, 1 − cos θy, 1 − cos θz.
    pub versine: [T; 3],
}

/// Power series of sine and versine, truncated where the rest is below the last bit over the permitted angles.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a, T> {
    /// Coefficients of sin x / x in x² after the leading 1: −1/3!, 1/5!, …
    pub sine: &'a [T],
    /// Coefficients of (1 − cos x) / x² in x²: 1/2!, −1/4!, …
    pub versine: &'a [T],
}

impl<T: Real> Series<'_, T> {
    /// Of θx, θy, θz, rad.
    #[inline]
    #[must_use]
    pub fn attitude(&self, angles: [T; 3]) -> Attitude<T> {
        let [x, y, z] = angles;
        Attitude {
            sine: [odd_series(self.sine, x), odd_series(self.sine, y), odd_series(self.sine, z)],
            versine: [even_series(self.versine, x), even_series(self.versine, y), even_series(self.versine, z)],
        }
    }
}

/// x (1 + c₀ x² + c₁ x⁴ + …).
#[inline]
pub fn odd_series<T: Real>(coefficients: &[T], x: T) -> T {
    let square = x * x;
    match horner(coefficients, square) {
        Some(tail) => x * (T::ONE + square * tail),
        None => x,
    }
}

/// x² (c₀ + c₁ x² + c₂ x⁴ + …).
#[inline]
pub fn even_series<T: Real>(coefficients: &[T], x: T) -> T {
    let square = x * x;
    match horner(coefficients, square) {
        Some(sum) => square * sum,
        None => T::ZERO,
    }
}

/// c₀ + c₁ x + c₂ x² + …, innermost first; none without coefficients.
#[inline]
pub fn horner<T: Real>(coefficients: &[T], x: T) -> Option<T> {
    let (last, rest) = coefficients.split_last()?;
    let mut sum = *last;
    for c in rest.iter().rev() {
        sum = *c + x * sum;
    }
    Some(sum)
}

impl<T: Real> Attitude<T> {
    /// cos θx, cos θy, cos θz.
    #[inline]
    #[must_use]
    pub fn cosine(&self) -> [T; 3] {
        let [x, y, z] = self.versine;
        [T::ONE - x, T::ONE - y, T::ONE - z]
    }

    /// R − I, row by row.
    #[inline]
    #[must_use]
    pub fn rotation_less_identity(&self) -> [[T; 3]; 3] {
        let ([sx, sy, sz], [vx, vy, vz], [cx, cy, cz]) = (self.sine, self.versine, self.cosine());
        [
            [vy * vz - vy - vz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + (vx * vz - vx - vz), cx * sy * sz - sx * cz],
            [-sy, sx * cy, vx * vy - vx - vy],
        ]
    }

    /// T(θ), row by row: ω = T θ̇ in base axes, rad/s. Its columns are the axes of rotation of θx, θy and θz.
    #[inline]
    #[must_use]
    pub fn rate_matrix(&self) -> [[T; 3]; 3] {
        let ([_, sy, sz], [_, cy, cz]) = (self.sine, self.cosine());
        [[cy * cz, -sz, T::ZERO], [cy * sz, cz, T::ZERO], [-sy, T::ZERO, T::ONE]]
    }

    /// T⁻¹(θ): θ̇ = T⁻¹ ω. Finite for |θy| < π/2; beyond, the three angles are no longer coordinates.
    #[inline]
    #[must_use]
    pub fn rate_matrix_inverse(&self) -> [[T; 3]; 3] {
        let ([_, sy, sz], [_, cy, cz]) = (self.sine, self.cosine());
        let (along, across) = (cz / cy, sz / cy);
        [[along, across, T::ZERO], [-sz, cz, T::ZERO], [sy * along, sy * across, T::ONE]]
    }

    /// dT/dt for the rates θ̇ (rad/s), row by row: ω̇ = T θ̈ + Ṫ θ̇.
    #[inline]
    #[must_use]
    pub fn rate_matrix_derivative(&self, rates: [T; 3]) -> [[T; 3]; 3] {
        let ([_, sy, sz], [_, cy, cz]) = (self.sine, self.cosine());
        let [_, ry, rz] = rates;
        [
            [-(sy * cz * ry) - cy * sz * rz, -(cz * rz), T::ZERO],
            [-(sy * sz * ry) + cy * cz * rz, -(sz * rz), T::ZERO],
            [-(cy * ry), T::ZERO, T::ZERO],
        ]
    }
}
