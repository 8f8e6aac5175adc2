//! Inverse dynamics: motion of the platform to leg forces and leg displacements.
//!
//! Poses are from rest, [x y z θx θy θz] in m and rad; rates and accelerations are their time derivatives. The model and its range are
//! in `specgen_runtime::dynamics`: angles up to π/4 and leg lengths within ±30 %; the controller accepts poses of the declared workspace only.

pub use crate::body::PLATFORM;
pub use specgen_runtime::{Load, Motion};

use crate::Real;
use specgen_runtime::Real as _;

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

/// M(h): kg, kg m, kg m². For analysis.
#[inline]
#[must_use]
pub fn mass_matrix(pose: &[Real; 6]) -> [[Real; 6]; 6] {
    PLATFORM.mass_matrix(pose)
}

/// C(h, ḣ) ḣ: N, N m. For analysis.
#[inline]
#[must_use]
pub fn coriolis(pose: &[Real; 6], rate: &[Real; 6]) -> [Real; 6] {
    PLATFORM.coriolis(pose, rate)
}

/// G(h): N, N m. For analysis.
#[inline]
#[must_use]
pub fn gravity(pose: &[Real; 6]) -> [Real; 6] {
    PLATFORM.gravity(pose)
}

/// J(h) = ∂l/∂h, a row per leg: m/m, m/rad. For analysis.
#[inline]
#[must_use]
pub fn jacobian(pose: &[Real; 6]) -> [[Real; 6]; 6] {
    PLATFORM.jacobian(pose)
}

/// Words of a motion: pose, rate, acceleration.
pub const MOTION_WORDS: usize = 18;

/// Words of an analysis: J and M row by row, C ḣ, G, leg forces, leg displacements.
pub const ANALYSIS_WORDS: usize = 96;

/// All of the above for one motion, as words, for tools on a host.
#[must_use]
pub fn analysis(words: &[u64; MOTION_WORDS]) -> [u64; ANALYSIS_WORDS] {
    let number = |k: usize| Real::from_word(words[k]);
    let six = |k: usize| [number(k), number(k + 1), number(k + 2), number(k + 3), number(k + 4), number(k + 5)];
    let motion = Motion { pose: six(0), rate: six(6), acceleration: six(12) };
    let load = load(&motion, None);
    let rows = [coriolis(&motion.pose, &motion.rate), gravity(&motion.pose), leg_forces(&motion), load.displacement];
    let (jacobian, mass) = (jacobian(&motion.pose), mass_matrix(&motion.pose));
    let mut out = [0; ANALYSIS_WORDS];
    let values = jacobian.iter().chain(&mass).chain(&rows).flatten();
    for (word, value) in out.iter_mut().zip(values) {
        *word = value.to_word();
    }
    out
}
