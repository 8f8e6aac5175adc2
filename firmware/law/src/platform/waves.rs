//! A wave in place of the host's set-points: its limits, and the input words that it writes.

use specgen_runtime::setpoint::CommandKind;
use specgen_runtime::wave::Limits;
use specgen_runtime::{Motion, Real};

use super::constants::Platform;
use crate::spec::{Config, ConstSpec};
use crate::status::GENERATOR_BUSY;

/// The limits of streams; from `control.setpoint` and `workspace`.
#[must_use]
pub fn limits<P: Platform + ConstSpec>(_config: &Config<P>) -> Limits<P::Real> {
    Limits::of(P::CONSTANTS.setpoints())
}

/// Whether a wave may begin with the next tick: the platform is at its bias pose and plays nothing. `status` is that of
/// the last tick, `words` is its command. The generator checks that the wave begins at the present pose: it refuses a
/// jump.
///
/// # Errors
/// It may not: the number of the axis, 0 for all.
pub fn may_begin<T: Real>(status: u32, words: &[u64], _center: &[T; 6], _limits: &Limits<T>) -> Result<(), usize> {
    let plays = words.first().is_some_and(|word| CommandKind::from_word(*word) == CommandKind::Trajectory);
    if status & GENERATOR_BUSY == 0 && !plays { Ok(()) } else { Err(0) }
}

/// Writes the set-point into the command's words, as the `sequence`-th of a stream.
pub fn write<T: Real>(motion: &Motion<T>, sequence: u32, words: &mut [u64]) {
    let numbers = motion.pose.iter().chain(&motion.rate).chain(&motion.acceleration);
    let all =
        [CommandKind::Stream.word(), 0, sequence as u64].into_iter().chain(numbers.map(|number| number.to_word()));
    for (slot, word) in words.iter_mut().zip(all) {
        *slot = word;
    }
}

/// Writes the command to stay where a wave has ended: hold.
pub fn rest<T: Real>(_center: &[T; 6], words: &mut [u64]) {
    if let Some(kind) = words.first_mut() {
        *kind = CommandKind::Hold.word();
    }
}
