//! Texts about poses: units, and the limits that a pose exceeds.

use crate::motion::Binding;
use crate::place::{AXES, amount};

/// Name of the user's zero pose.
pub const ZERO: &str = "zero";

/// The exceeded limit as text.
pub fn in_words(binding: &Binding) -> String {
    match *binding {
        Binding::Axis { axis, at, bound } => {
            let (name, place, limit) = (AXES[axis], amount(axis, at), amount(axis, bound));
            format!("{name} would be at {place} from rest, outside the workspace of +-{limit}")
        }
        Binding::Leg { leg, at, range: [low, high] } => {
            let (place, lowest, highest) = (amount(0, at), amount(0, low), amount(0, high));
            format!("leg {leg} would be {place} from rest, outside its range of {lowest} to {highest}")
        }
    }
}

/// Unit of an axis in texts and answers.
pub(super) fn unit(axis: usize) -> &'static str {
    if axis < 3 { "um" } else { "urad" }
}
