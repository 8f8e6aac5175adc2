//! Leg kinematics in difference form: leg displacements from rest, without the cancellation of |r| − l₀, and the
//! inverse.

use crate::spec::{LEGS, Spec};

/// Δl_i = |P₀ + t + R P_i − B_i| − l₀ of each leg, m, positive when it gets longer.
///
/// `pose` is [x y z θx θy θz] from rest: translation t of P_C in {B} (m) and rotation R = Rz(θz) Ry(θy) Rx(θx) about
/// fixed axes (AI.1) (rad), within the declared workspace.
// As a call it would take 90 instructions of a tick.
#[inline(always)]
#[must_use]
pub fn leg_displacements<P: Spec>(p: P, pose: &[P::Real; 6]) -> [P::Real; LEGS] {
    p.geometry().displacements(pose)
}

/// The pose at which the legs have these displacements (m): the inverse of [`leg_displacements`] within the declared
/// workspace.
#[inline]
#[must_use]
pub fn pose_from_legs<P: Spec>(p: P, displacements: &[P::Real; LEGS]) -> [P::Real; 6] {
    p.geometry().pose(p.inverse_jacobian(), p.corrections(), displacements)
}
