//! A wave in place of the host's set-points, or of the voltages of an open drive: its limits, and the input words that
//! it writes.

use specgen_runtime::setpoint::CommandKind;
use specgen_runtime::wave::Limits;
use specgen_runtime::{Motion, Real};

use super::constants::Platform;
use super::tick::VOLTAGES;
use crate::spec::{Config, ConstSpec};
use crate::status::GENERATOR_BUSY;

/// The limits of streams; from `control.setpoint` and `workspace`.
#[must_use]
pub fn limits<P: Platform + ConstSpec>(_config: &Config<P>) -> Limits<P::Real> {
    Limits::of(P::CONSTANTS.setpoints())
}

/// The limits of an open drive: those of the voltages, V, and of their slew rate.
#[must_use]
pub fn drive_limits<P: Platform + ConstSpec>(config: &Config<P>) -> Limits<P::Real> {
    let p = P::CONSTANTS;
    let codes = config.code_limits;
    let ticks_per_second = p.setpoints().rate;
    let slew_rate = P::Real::from_i32(codes.max_step) * p.dac().volts_per_code * ticks_per_second;
    Limits {
        low: [p.dac().voltage(codes.min); 6],
        high: [p.dac().voltage(codes.max); 6],
        rate: [slew_rate; 6],
        // A leg may reverse within a tick.
        acceleration: [(slew_rate + slew_rate) * ticks_per_second; 6],
        ticks_per_second,
    }
}

/// Whether a wave of an open drive may begin: each leg is at its center, V, within its motion in a tick. `place` are
/// the words of [`place_words`](super::tick::place_words).
#[must_use]
pub fn may_drive<T: Real>(place: &[u64], center: &[T; 6], limits: &Limits<T>) -> bool {
    let voltages = place.iter().skip(VOLTAGES);
    voltages
        .zip(center)
        .zip(limits.rate)
        .all(|((word, center), rate)| (T::from_word(*word) - *center).abs() * limits.ticks_per_second <= rate)
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

/// Writes the set-point into the command's words, as the `sequence`-th of a stream, or as voltages of an open drive.
pub fn write<T: Real>(motion: &Motion<T>, sequence: u32, drives: bool, words: &mut [u64]) {
    let numbers = motion.pose.iter().chain(&motion.rate).chain(&motion.acceleration);
    let kind = if drives { CommandKind::Drive } else { CommandKind::Stream };
    let all = [kind.word(), 0, sequence as u64].into_iter().chain(numbers.map(|number| number.to_word()));
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
