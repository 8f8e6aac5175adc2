//! Digital lines: six legs, which have no pose, have none.

use crate::{Config, State, TickInput};
use specgen_runtime::supervisor::Phase;

pub use specgen_runtime::trigger::{MOST, lines};

/// Output lines of this controller.
pub const LINES: usize = 0;
/// Whether it has an input line.
pub const INPUT: bool = false;

/// No line is high.
pub(crate) fn act(_config: &Config, _state: &mut State, _phase: Phase, _input: &TickInput, _status: u32) -> u32 {
    0
}
