//! Passes of a motion that repeats: six legs, which learn from tick to tick, have none.

use crate::{COMMAND_WORDS, Real, State};
use specgen_runtime::pass::Given;

/// Whether this controller takes a correction, which passes are for.
pub const POSSIBLE: bool = false;

/// Whether a pass may begin.
#[must_use]
pub fn may_begin(_status: u32, _words: &[u64]) -> bool {
    POSSIBLE
}

/// Writes nothing.
pub fn write(_given: &Given<Real>, _words: &mut [u64; COMMAND_WORDS]) {}

/// Writes nothing.
pub fn begin(_trajectory: u32, _words: &mut [u64; COMMAND_WORDS]) {}

/// Writes nothing.
pub fn end(_words: &mut [u64; COMMAND_WORDS]) {}

/// What a tick shows of a pass.
#[must_use]
pub fn shown(_state: &State) -> Option<[[Real; 6]; 2]> {
    None
}
