// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Inverse dynamics: motion of the platform to leg forces and leg displacements.
//!
//! Poses are from rest, [x y z θx θy θz] in m and rad; rates and accelerations are their time derivatives. The model and its range are
//! in `specgen_runtime::dynamics`: angles up to π/4 and leg lengths within ±30 %; the controller accepts poses of the declared workspace only.

pub use crate::body::PLATFORM;
pub use specgen_runtime::{Load, Motion};

use crate::Real;

/// Six leg forces for a motion, N, > 0 pushes the platform: J⁻ᵀ (M ḧ + C ḣ + G).
#[inline]
#[must_use]
pub fn leg_forces(motion: &Motion<Real>) -> [Real; 6] {
    PLATFORM.leg_forces(motion)
}

/// Leg displacements (m) and leg forces (N) for a motion, under a wrench on the platform if there is one: force (N) and torque (N m) about
/// P_C, base axes.
#[inline]
#[must_use]
pub fn load(motion: &Motion<Real>, wrench: Option<&[Real; 6]>) -> Load<Real> {
    PLATFORM.load(motion, wrench)
}
