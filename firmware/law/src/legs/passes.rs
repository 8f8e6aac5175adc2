//! Passes of a motion that repeats: six legs, which learn from tick to tick, have none.

use specgen_runtime::Real;
use specgen_runtime::pass::Given;

use super::constants::SixLegs;
use super::state::State;

/// Whether a pass may begin.
#[must_use]
pub fn may_begin(_status: u32, _words: &[u64]) -> bool {
    false
}

/// Writes nothing.
pub fn write<T: Real>(_given: &Given<T>, _words: &mut [u64]) {}

/// Writes nothing.
pub fn begin(_trajectory: u32, _words: &mut [u64]) {}

/// Writes nothing.
pub fn end<T: Real>(_words: &mut [u64]) {}

/// What a tick shows of a pass.
#[must_use]
pub fn shown<P: SixLegs>(_state: &State<P>) -> Option<[[P::Real; 6]; 2]> {
    None
}
