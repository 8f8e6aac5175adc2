//! A pass of a repeated motion: the command words that it writes, and the result of a tick.

use specgen_runtime::Real;
use specgen_runtime::pass::PassInput;
use specgen_runtime::setpoint::CommandKind;

use super::tick::command_words;
use crate::status::GENERATOR_BUSY;

/// Whether a pass may begin with the next tick: no motion is under way, and no trajectory is requested. `status` is
/// that of the last tick, `words` is its command.
#[must_use]
pub fn may_begin(status: u32, words: &[u64]) -> bool {
    let plays = words.first().is_some_and(|word| CommandKind::from_word(*word) == CommandKind::Trajectory);
    status & GENERATOR_BUSY == 0 && !plays
}

/// Writes the correction, and the trajectory that begins, into the command's words.
pub fn write<T: Real>(given: &PassInput<T>, words: &mut [u64]) {
    for (slot, number) in words.iter_mut().skip(command_words(0)).zip(&given.correction) {
        *slot = number.to_word();
    }
    if let Some(trajectory) = given.begins {
        begin(trajectory, words);
    }
}

/// Writes the command that plays a trajectory.
pub fn begin(trajectory: u32, words: &mut [u64]) {
    if let Some([kind, selector]) = words.first_chunk_mut() {
        (*kind, *selector) = (CommandKind::Trajectory.word(), trajectory as u64);
    }
}

/// Writes a correction of zero.
pub fn end<T: Real>(words: &mut [u64]) {
    for slot in words.iter_mut().skip(command_words(0)) {
        *slot = T::ZERO.to_word();
    }
}
