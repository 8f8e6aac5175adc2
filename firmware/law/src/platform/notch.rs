//! Errors and innovations in modal coordinates, and the notch on each mode. Without a notch in the spec both are
//! unchanged.

use specgen_runtime::NotchState;
use specgen_runtime::linear::transform;

use super::constants::Platform;

/// V⁻¹ e: the pose error in modal coordinates.
#[inline]
#[must_use]
pub fn modal_error<P: Platform>(p: P, error: &[P::Real; 6]) -> [P::Real; 6] {
    match p.notch() {
        Some(notch) => transform(&notch.pose_to_modes, error),
        None => *error,
    }
}

/// N(e) of a modal error, m and rad.
#[inline]
#[must_use]
pub fn notch_error<P: Platform>(p: P, state: &mut NotchState<P::Real>, modal_error: &[P::Real; 6]) -> [P::Real; 6] {
    match p.notch() {
        Some(notch) => transform(&notch.modes_to_pose, &state.filter(&notch.sections, modal_error)),
        None => *modal_error,
    }
}

/// N of an innovation in modal coordinates.
#[inline]
#[must_use]
pub fn notch_innovation<P: Platform>(p: P, state: &mut NotchState<P::Real>, innovation: &[P::Real; 6]) -> [P::Real; 6] {
    match p.notch() {
        Some(notch) => state.filter(&notch.sections, innovation),
        None => *innovation,
    }
}
