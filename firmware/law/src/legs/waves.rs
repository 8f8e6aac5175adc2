//! A wave in place of the host's set-points: its limits, and the input words that it writes.

use specgen_runtime::wave::Limits;
use specgen_runtime::{Motion, Real, SetpointKind};

use super::constants::SixLegs;
use crate::kinematics::leg_displacements;
use crate::spec::{Config, ConstSpec};

/// Not a limit of the spec: legs are limited by the slew rate of the amplifiers, m/s².
const ACCELERATION: f64 = 1e6;

/// Range from `actuator.stroke` or, if set-points are poses, `workspace`. The rate is the present slew limit of a leg,
/// shared by the six axes of a pose.
#[must_use]
pub fn limits<P: SixLegs + ConstSpec>(config: &Config<P>) -> Limits<P::Real> {
    let p = P::CONSTANTS;
    let ticks_per_second = P::Real::from_f64(1.0 / p.period_seconds());
    let codes = P::Real::from_i32(config.code_limits.max_step);
    let rate = codes * p.dac().volts_per_code * p.leg_gain() * ticks_per_second;
    let mut limits = Limits {
        low: [p.leg_setpoint()[0]; 6],
        high: [p.leg_setpoint()[1]; 6],
        rate: [rate; 6],
        acceleration: [P::Real::from_f64(ACCELERATION); 6],
        ticks_per_second,
    };
    if config.setpoint == SetpointKind::Pose {
        for (axis, bound) in p.pose_bound().iter().enumerate() {
            let mut pose = [P::Real::ZERO; 6];
            pose[axis] = *bound;
            let mut longest: P::Real = P::Real::ZERO;
            for leg in leg_displacements(p, &pose) {
                if leg.abs() > longest {
                    longest = leg.abs();
                }
            }
            limits.low[axis] = -*bound;
            limits.high[axis] = *bound;
            limits.rate[axis] = if longest > P::Real::ZERO {
                rate * *bound / (P::Real::from_f64(6.0) * longest)
            } else {
                P::Real::ZERO
            };
        }
    }
    limits
}

/// Those of an open drive, which six legs do not have.
#[must_use]
pub fn drive_limits<P: SixLegs + ConstSpec>(config: &Config<P>) -> Limits<P::Real> {
    limits(config)
}

/// Whether a wave of an open drive may begin: never.
#[must_use]
pub fn may_drive<T: Real>(_place: &[u64], _center: &[T; 6], _limits: &Limits<T>) -> bool {
    false
}

/// Whether a wave may begin with the next tick: the present set-point, in `words`, must be its center, within an axis's
/// motion in a tick. Otherwise legs would jump.
///
/// # Errors
/// The first axis that is not there.
pub fn may_begin<T: Real>(_status: u32, words: &[u64], center: &[T; 6], limits: &Limits<T>) -> Result<(), usize> {
    for (axis, (word, center)) in words.iter().zip(center).enumerate() {
        let away = (T::from_word(*word) - *center).abs();
        let near = away * limits.ticks_per_second <= limits.rate[axis];
        if !near {
            return Err(axis);
        }
    }
    Ok(())
}

/// Writes the set-point into the words of a tick's input.
pub fn write<T: Real>(motion: &Motion<T>, _sequence: u32, _drives: bool, words: &mut [u64]) {
    rest(&motion.pose, words);
}

/// Writes the command to stay where a wave around `center` has ended.
pub fn rest<T: Real>(center: &[T; 6], words: &mut [u64]) {
    for (slot, number) in words.iter_mut().zip(center) {
        *slot = number.to_word();
    }
}
