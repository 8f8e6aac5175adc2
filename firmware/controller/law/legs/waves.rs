//! A wave in place of the host's set-points: what it has to keep to, and the input words that it writes.

use crate::kinematics::{POSE_BOUND, leg_displacements};
use crate::limits::DAC;
use crate::sensing::LEG_SETPOINT;
use crate::{Config, LEG_GAIN, PERIOD_SECONDS, Real, SetpointKind};
use specgen_runtime::wave::Limits;
use specgen_runtime::{Motion, Real as _, wave};

/// No limit of the spec: the slew rate of the amplifiers is what a leg has to keep to, m/s².
const ACCELERATION: Real = 1e6;

/// Range from `actuator.stroke` or, where set-points are poses, `workspace`; the rate is what the slew limit in force
/// leaves a leg, shared by the six axes of a pose.
#[must_use]
pub fn limits(config: &Config) -> Limits<Real> {
    let ticks_per_second = (1.0 / PERIOD_SECONDS) as Real;
    let codes = Real::from_i32(config.code_limits().max_step);
    let rate = codes * DAC.volts_per_code * LEG_GAIN * ticks_per_second;
    let mut limits = Limits {
        low: [LEG_SETPOINT[0]; 6],
        high: [LEG_SETPOINT[1]; 6],
        rate: [rate; 6],
        acceleration: [ACCELERATION; 6],
        ticks_per_second,
    };
    if config.setpoint() == SetpointKind::Pose {
        for (axis, bound) in POSE_BOUND.iter().enumerate() {
            let mut pose = [0.0; 6];
            pose[axis] = *bound;
            let mut longest: Real = 0.0;
            for leg in leg_displacements(&pose) {
                if leg.abs() > longest {
                    longest = leg.abs();
                }
            }
            limits.low[axis] = -*bound;
            limits.high[axis] = *bound;
            limits.rate[axis] = if longest > 0.0 { rate * *bound / (6.0 * longest) } else { 0.0 };
        }
    }
    limits
}

/// A wave may begin with the next tick: the set-point in force, in `words`, is its center, but for what an axis may move
/// in a tick. Legs would jump otherwise.
///
/// # Errors
/// The first axis that stands elsewhere.
pub fn may_begin(_status: u32, words: &[u64], center: &[Real; 6], limits: &Limits<Real>) -> Result<(), usize> {
    for (axis, (word, center)) in words.iter().zip(center).enumerate() {
        let away = (Real::from_word(*word) - *center).abs();
        let near = away * limits.ticks_per_second <= limits.rate[axis];
        if !near {
            return Err(axis);
        }
    }
    Ok(())
}

/// Writes the set-point into the words of a tick's input.
pub fn write(motion: &Motion<Real>, _sequence: u32, words: &mut [u64]) {
    rest(&motion.pose, words);
}

/// Writes the command to stay where a wave about `center` has come to rest.
pub fn rest(center: &[Real; 6], words: &mut [u64]) {
    for (slot, number) in words.iter_mut().zip(center) {
        *slot = number.to_word();
    }
}

/// The wave generator of this controller.
pub type Wave = wave::Wave<Real>;
