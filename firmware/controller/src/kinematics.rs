// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Leg kinematics in difference form: leg displacements from rest, without the cancellation of |r| − l₀, and the pose that has them.

pub(crate) use crate::geometry::POSE_BOUND;
pub use crate::geometry::{GEOMETRY, INVERSE_JACOBIAN, SERIES};

use crate::geometry::CORRECTIONS;
use crate::{LEGS, Real};

/// Every component is finite and within the declared workspace.
#[inline]
#[must_use]
pub fn pose_is_accepted(pose: &[Real; 6]) -> bool {
    pose.iter().zip(&POSE_BOUND).all(|(value, bound)| (-*bound..=*bound).contains(value))
}

/// Δl_i = |P₀ + t + R P_i − B_i| − l₀ of each leg, m, positive when it gets longer.
///
/// `pose` is [x y z θx θy θz] from rest: translation t of P_C in {B} (m) and rotation R = Rz(θz) Ry(θy) Rx(θx) about
/// fixed axes (AI.1) (rad), within the declared workspace.
#[inline]
#[must_use]
pub fn leg_displacements(pose: &[Real; 6]) -> [Real; LEGS] {
    GEOMETRY.displacements(pose)
}

/// The pose at which the legs have these displacements (m): the inverse of [`leg_displacements`] within the declared
/// workspace.
#[inline]
#[must_use]
pub fn pose_from_legs(displacements: &[Real; LEGS]) -> [Real; 6] {
    GEOMETRY.pose(&INVERSE_JACOBIAN, CORRECTIONS, displacements)
}
