//! Texts about poses: units, and the limits that a pose exceeds.

use crate::motion::Binding;
use crate::place::{AXES, amount};

/// Name of the user's zero pose.
pub const ZERO: &str = "zero";

/// The exceeded limit as text.
pub fn in_words(binding: &Binding) -> String {
    match *binding {
        Binding::Axis { axis, at, bound } => format!(
            "{} would be at {} from rest, outside the workspace of +-{}",
            AXES[axis],
            amount(axis, at),
            amount(axis, bound)
        ),
        Binding::Leg { leg, at, range: [low, high] } => format!(
            "leg {leg} would be {} from rest, outside its range of {} to {}",
            amount(0, at),
            amount(0, low),
            amount(0, high)
        ),
    }
}

/// Unit of an axis in texts and answers.
pub(super) fn unit(axis: usize) -> &'static str {
    if axis < 3 { "um" } else { "urad" }
}
