//! Poses in words: their units, and what keeps a platform from going somewhere.

use crate::motion::Binding;
use crate::place::{AXES, amount};

/// The name that the user's zero always has.
pub const ZERO: &str = "zero";

/// What binds, in words.
pub fn in_words(binding: &Binding) -> String {
    match *binding {
        Binding::Axis { axis, at, bound } => format!(
            "{} would be at {} from rest, outside the workspace of +-{}",
            AXES[axis],
            amount(axis, at),
            amount(axis, bound)
        ),
        Binding::Leg { leg, at, range: [low, high] } => format!(
            "leg {leg} would be {} from rest, beyond what it can do, {} to {}",
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
