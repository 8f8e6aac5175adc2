//! Poses in words: where a platform is, and what keeps it from going somewhere.

use std::fmt::Write as _;

use serde::Serialize;
use specgen_operate::motion::Binding;
use specgen_operate::place::{AXES, amount};

use crate::cli::table::{left, right, row};
use crate::cli::ui::Outcome;

/// The name that the user's zero always has.
pub const ZERO: &str = "zero";

/// Where a platform is: µm and µrad, V.
#[derive(Serialize)]
pub struct Located {
    pub(super) tick: u64,
    pub(super) pose: [f64; 6],
    pub(super) target: [f64; 6],
    pub(super) error: [f64; 6],
    pub(super) voltage: [f64; 6],
    pub(super) moves: bool,
}

impl Outcome for Located {
    fn text(&self) -> String {
        let mut text = String::new();
        let columns = [left(6), right(12), right(14), right(12), left(0).behind("  ")];
        row(&mut text, &columns, &[&"", &"pose", &"set-point", &"error"]);
        for (axis, name) in AXES.iter().enumerate() {
            let cells = [self.pose[axis], self.target[axis], self.error[axis]].map(|value| format!("{value:.4}"));
            row(&mut text, &columns, &[&format!("  {name}"), &cells[0], &cells[1], &cells[2], &unit(axis)]);
        }
        let volts: Vec<String> = self.voltage.iter().map(|voltage| format!("{voltage:.2}")).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  legs 0 to 5: {} V{}", volts.join(", "), if self.moves { "; moving" } else { "" });
        text
    }
}

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
