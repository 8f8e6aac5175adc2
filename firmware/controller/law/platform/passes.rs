//! A pass of a motion that repeats: what it writes into the words of a command, and what a tick shows of it.

use crate::task_space::CORRECTED;
use crate::{COMMAND_WORDS, GENERATOR_BUSY, Real, State};
use specgen_runtime::Real as _;
use specgen_runtime::pass::Given;
use specgen_runtime::setpoint::CommandKind;

/// Whether this controller takes a correction, which passes are for.
pub const POSSIBLE: bool = CORRECTED != 0;

/// A pass may begin with the next tick: no motion is under way, and no trajectory is what is asked for. `status` is that of the last tick,
/// `words` is the command that it ran under.
#[must_use]
pub fn may_begin(status: u32, words: &[u64]) -> bool {
    let plays = words.first().is_some_and(|word| CommandKind::from_word(*word) == CommandKind::Trajectory);
    POSSIBLE && status & GENERATOR_BUSY == 0 && !plays
}

/// Writes the correction into the command's words, and the trajectory that begins.
pub fn write(given: &Given<Real>, words: &mut [u64; COMMAND_WORDS]) {
    for (slot, number) in words.iter_mut().skip(COMMAND_WORDS - CORRECTED).zip(&given.correction) {
        *slot = number.to_word();
    }
    if let Some(trajectory) = given.begins {
        begin(trajectory, words);
    }
}

/// Writes the command that plays a trajectory.
pub fn begin(trajectory: u32, words: &mut [u64; COMMAND_WORDS]) {
    words[0] = CommandKind::Trajectory.word();
    words[1] = trajectory as u64;
}

/// Writes that nothing is corrected.
pub fn end(words: &mut [u64; COMMAND_WORDS]) {
    let nothing: Real = 0.0;
    for slot in words.iter_mut().skip(COMMAND_WORDS - CORRECTED) {
        *slot = nothing.to_word();
    }
}

/// What a tick shows: h_d for its end, and h at its beginning, m and rad.
#[must_use]
pub fn shown(state: &State) -> Option<[[Real; 6]; 2]> {
    Some([state.generator.target().pose, state.pose])
}
