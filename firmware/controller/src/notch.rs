// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Errors and innovations in modal coordinates, and the notch on each mode. Without a notch in the spec both are what they were.

use crate::Real;
use crate::task_space::NOTCH;
use specgen_runtime::NotchState;
use specgen_runtime::linear::transform;

/// V⁻¹ e: the pose error in modal coordinates.
#[inline]
#[must_use]
pub(crate) fn modal_error(error: &[Real; 6]) -> [Real; 6] {
    match &NOTCH {
        Some(notch) => transform(&notch.pose_to_modes, error),
        None => *error,
    }
}

/// N(e) of a modal error, m and rad.
#[inline]
#[must_use]
pub(crate) fn notch_error(state: &mut NotchState<Real>, modal_error: &[Real; 6]) -> [Real; 6] {
    match &NOTCH {
        Some(notch) => transform(&notch.modes_to_pose, &state.filter(&notch.sections, modal_error)),
        None => *modal_error,
    }
}

/// N of an innovation in modal coordinates.
#[inline]
#[must_use]
pub(crate) fn notch_innovation(state: &mut NotchState<Real>, innovation: &[Real; 6]) -> [Real; 6] {
    match &NOTCH {
        Some(notch) => state.filter(&notch.sections, innovation),
        None => *innovation,
    }
}
