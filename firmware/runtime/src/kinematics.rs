//! Leg kinematics in difference form: leg displacements from rest, without the cancellation of |r| − l₀, and back.
//!
//! ```text
//! d_i  = t + E P_i,  E = R − I               how far platform joint i moved
//! Δl_i = |r₀_i + d_i| − l₀_i                the root of Δl² + 2 l₀ Δl = s,  s = (2 r₀ + d)·d
//! s/2  = r₀·t + |t|²/2 + (r₀ − P + t)·E P    as |E P|² = −2 P·E P for a rotation: linear in numbers that all legs share
//! Δl   = u (1 − τ/2 + τ²/2 − 5/8 τ³ + …)     u = s/(2 l₀), τ = u/l₀
//! h ← h + J⁻¹ (Δl − Δl(h)),  J = ∂l/∂h at rest      forward kinematics, a fixed number of times
//! ```
//!
//! # Example
//!
//! Six vertical legs of 40 mm. A rise of 10 mm makes each 10 mm longer, and so does a shift of 30 mm, because 30, 40
//! and 50 mm are the sides of a right triangle:
//!
//! ```
//! use specgen_runtime::{Legs, Series};
//!
//! let legs = Legs::<f64> {
//!     rest_leg: [[0.0, 0.0, 0.04]; 6],
//!     platform_joint: [[0.1, 0.0, 0.0]; 6],
//!     rest_length: [0.04; 6],
//!     series: Series { sine: &[-1.0 / 6.0, 1.0 / 120.0], versine: &[1.0 / 2.0, -1.0 / 24.0] },
//!     root: &[],
//!     newton_steps: 5,
//! };
//! for pose in [[0.0, 0.0, 0.01, 0.0, 0.0, 0.0], [0.03, 0.0, 0.0, 0.0, 0.0, 0.0]] {
//!     assert!((legs.displacements(&pose)[0] - 0.01).abs() < 1e-12);
//! }
//! // A tilt by −1 mrad about y lifts the joint at x = 100 mm by 0.1 mm.
//! assert!((legs.displacements(&[0.0, 0.0, 0.0, 0.0, -1e-3, 0.0])[0] - 1e-4).abs() < 1e-9);
//! ```

use crate::attitude::Series;
use crate::linear::{difference, each, transform};
use crate::real::Real;

/// Terms of u that legs may share.
const TERMS: usize = 14;

/// The legs of a platform.
#[derive(Debug, Clone, Copy)]
pub struct Legs<'a, T> {
    /// Leg vectors at rest r₀ = P₀ + P_i − B_i (AI.2), base frame, m.
    pub rest_leg: [[T; 3]; 6],
    /// Platform joints P_i (2), (AI.4), platform frame, m.
    pub platform_joint: [[T; 3]; 6],
    /// Leg lengths at rest l₀ = |r₀|, m.
    pub rest_length: [T; 6],
    /// Sine and versine over the permitted angles.
    pub series: Series<'a, T>,
    /// Coefficients of the root in τ after the leading 1: −1/2, 1/2, −5/8, … None: s / (2 l₀).
    pub root: &'a [T],
    /// Newton steps from there to the root; each takes a division.
    pub newton_steps: usize,
}

impl<T: Real> Legs<'_, T> {
    /// Δl_i = |P₀ + t + R P_i − B_i| − l₀ of each leg, m, positive when it gets longer.
    ///
    /// `pose` is [x y z θx θy θz] from rest: translation t of P_C in {B} (m) and rotation R = Rz(θz) Ry(θy) Rx(θx)
    /// about fixed axes (AI.1) (rad), within the bounds of series and steps.
    // Inlined, because its many constants are then folded.
    #[inline(always)]
    #[must_use]
    pub fn displacements(&self, pose: &[T; 6]) -> [T; 6] {
        let [x, y, z, tilt_x, tilt_y, tilt_z] = *pose;
        let turn = self.series.attitude([tilt_x, tilt_y, tilt_z]).rotation_less_identity();
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = turn;
        let inverse = each(|leg| T::ONE / self.rest_length[leg]);
        let height = self.rest_leg[0][2] - self.platform_joint[0][2];
        let level = z + height;
        let swept = [x * ax + y * bx + level * cx, x * ay + y * by + level * cy, x * az + y * bz + level * cz];
        let values = [ax, ay, az, bx, by, bz, cx, cy, cz, swept[0], swept[1], swept[2], x, y];
        let shift = T::HALF * (x * x + y * y + z * z);
        // u of all legs side by side, term by term, so that no product waits for the one before. The small terms come
        // first.
        let start = each(|leg| (shift + z * self.rest_leg[leg][2]) * inverse[leg]);
        let factors = each(|leg| self.factors(leg, inverse[leg], height));
        self.extensions(&sums(&factors, &values, start), &inverse)
    }

    /// Factors of the terms of u = s/(2 l₀): those of E row by row, of tᵀE with `height` in it, of x and y.
    #[inline(always)]
    fn factors(&self, leg: usize, inverse: T, height: T) -> [T; TERMS] {
        let ([rx, ry, rz], [px, py, pz]) = (self.rest_leg[leg], self.platform_joint[leg]);
        // r₀ − P: from the base joint to P_C at rest. Its height is usually the same for all legs.
        let (fx, fy, fz) = ((rx - px) * inverse, (ry - py) * inverse, (rz - pz - height) * inverse);
        [
            fx * px,
            fx * py,
            fx * pz,
            fy * px,
            fy * py,
            fy * pz,
            fz * px,
            fz * py,
            fz * pz,
            px * inverse,
            py * inverse,
            pz * inverse,
            rx * inverse,
            ry * inverse,
        ]
    }

    /// Δl of each leg for u = s/(2 l₀), m.
    #[inline(always)]
    fn extensions(&self, way: &[T; 6], inverse: &[T; 6]) -> [T; 6] {
        let ratio = each(|leg| way[leg] * inverse[leg]);
        let mut root = *way;
        if let Some((last, rest)) = self.root.split_last() {
            let mut tail = [*last; 6];
            for c in rest.iter().rev() {
                tail = each(|leg| *c + ratio[leg] * tail[leg]);
            }
            root = each(|leg| way[leg] + way[leg] * ratio[leg] * tail[leg]);
        }
        for _ in 0..self.newton_steps {
            let length = &self.rest_length;
            root = each(|leg| (way[leg] * length[leg] + T::HALF * (root[leg] * root[leg])) / (length[leg] + root[leg]));
        }
        root
    }

    /// The pose at which the legs have these displacements (m): forward kinematics.
    ///
    /// `inverse` is J⁻¹ of the legs at rest, J = ∂l/∂h. Each of the `corrections` reduces the error by the relative
    /// change of J within the workspace.
    #[inline]
    #[must_use]
    pub fn pose(&self, inverse: &[[T; 6]; 6], corrections: usize, displacements: &[T; 6]) -> [T; 6] {
        let mut pose = transform(inverse, displacements);
        for _ in 0..corrections {
            let reached = self.displacements(&pose);
            let correction = transform(inverse, &difference(displacements, &reached));
            pose = each(|axis| pose[axis] + correction[axis]);
        }
        pose
    }
}

/// `start` plus the terms, one by one. Terms with a factor of zero are left out.
#[inline(always)]
fn sums<T: Real>(factors: &[[T; TERMS]; 6], values: &[T; TERMS], start: [T; 6]) -> [T; 6] {
    let [a, b, c, d, e, f] = factors;
    let mut sums = start;
    let add = |sums: [T; 6], k: usize| {
        let plus = |sum: T, factor: T| if factor == T::ZERO { sum } else { sum + factor * values[k] };
        let [u, v, w, x, y, z] = sums;
        [plus(u, a[k]), plus(v, b[k]), plus(w, c[k]), plus(x, d[k]), plus(y, e[k]), plus(z, f[k])]
    };
    sums = add(add(add(add(add(sums, 0), 1), 2), 3), 4);
    sums = add(add(add(add(add(sums, 5), 6), 7), 8), 9);
    add(add(add(add(sums, 10), 11), 12), 13)
}
