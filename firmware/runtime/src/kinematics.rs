//! Leg kinematics in difference form: leg displacements from rest, without the cancellation of |r| − l₀, and back.
//!
//! ```text
//! d_i  = t + (R − I) P_i                    how far platform joint i moved
//! Δl_i = |r₀_i + d_i| − l₀_i                the root of Δl² + 2 l₀ Δl = (2 r₀ + d)·d
//! h ← h + J⁻¹ (Δl − Δl(h)),  J = ∂l/∂h at rest      forward kinematics, a fixed number of times
//! ```

use crate::attitude::Series;
use crate::linear::{difference, each, transform};
use crate::real::Real;

/// The legs of a platform.
#[derive(Debug, Clone, Copy)]
pub struct Legs<'a, T> {
    /// Leg vectors at rest r₀ = P₀ + P_i − B_i (AI.2), base frame, m.
    pub rest_leg: [[T; 3]; 6],
    /// Platform joints P_i (2), (AI.4), platform frame, m.
    pub platform_joint: [[T; 3]; 6],
    /// Leg lengths at rest l₀ = |r₀|, m.
    pub rest_length: [T; 6],
    /// Sine and versine over the angles that occur.
    pub series: Series<'a, T>,
    /// Newton steps from s / (2 l₀) to the root.
    pub newton_steps: usize,
}

impl<T: Real> Legs<'_, T> {
    /// Δl_i = |P₀ + t + R P_i − B_i| − l₀ of each leg, m, positive when it gets longer.
    ///
    /// `pose` is [x y z θx θy θz] from rest: translation t of P_C in {B} (m) and rotation R = Rz(θz) Ry(θy) Rx(θx) about
    /// fixed axes (AI.1) (rad), within the bounds that series and steps are made for.
    #[inline]
    #[must_use]
    pub fn displacements(&self, pose: &[T; 6]) -> [T; 6] {
        let [x, y, z, tilt_x, tilt_y, tilt_z] = *pose;
        let turn = self.series.attitude([tilt_x, tilt_y, tilt_z]).rotation_less_identity();
        let mut displacements = [T::ZERO; 6];
        for (leg, displacement) in displacements.iter_mut().enumerate() {
            let p = &self.platform_joint[leg];
            let add = |sum: T, constant: T, value: T| if constant == T::ZERO { sum } else { sum + value * constant };
            let by = |place: T, turn: &[T; 3]| add(add(add(place, p[0], turn[0]), p[1], turn[1]), p[2], turn[2]);
            let moved = [by(x, &turn[0]), by(y, &turn[1]), by(z, &turn[2])];
            *displacement = extension(&self.rest_leg[leg], self.rest_length[leg], self.newton_steps, &moved);
        }
        displacements
    }

    /// The pose at which the legs have these displacements (m): forward kinematics.
    ///
    /// `inverse` is J⁻¹ of the legs at rest, J = ∂l/∂h; each of the `corrections` brings the pose nearer by the factor that
    /// J changes by within the workspace.
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

/// |r₀ + d| − l₀ for a joint that moved by d: the root Δl of Δl² + 2 l₀ Δl = s with s = (2 r₀ + d)·d.
#[inline]
fn extension<T: Real>(rest: &[T; 3], length: T, newton_steps: usize, moved: &[T; 3]) -> T {
    let two = T::ONE + T::ONE;
    let s = (two * rest[0] + moved[0]) * moved[0]
        + (two * rest[1] + moved[1]) * moved[1]
        + (two * rest[2] + moved[2]) * moved[2];
    let mut root = s / (two * length);
    for _ in 0..newton_steps {
        root = (s + root * root) / (two * (length + root));
    }
    root
}
