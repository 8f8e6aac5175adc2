//! Limits of stops: from the spec, or derived from the dynamics of legs and amplifiers.
//!
//! With derived limits a stop from the largest declared speed v takes the time t and just reaches both limits: a = 1.5 v/t,
//! j = 6 v/t² (see `specgen_runtime::setpoint::Stop`). Stops from lower speeds are shorter, but take at least two thirds of t. t is the
//! least time such that
//! * it is at least a share of the period of the platform's lowest mode: the feed-forward of inertia is only as accurate as the
//!   stiffness, and shorter stops would excite ringing;
//! * the amplifiers follow;
//! * the stop's contribution to the voltage rate of a leg stays within `actuator.slew_rate`, with all axes stopping at once;
//! * inertia deflects no leg by more than a share of its stroke.

use specgen_runtime::setpoint::StopLimits;

use super::User;
use crate::lower;
use crate::stability::platform::{ModalBasis, RestDynamics, lead};
use specgen_language::model::{Model, TaskSpace};

/// Least time of a stop, in periods of the lowest mode.
const PERIODS: f64 = 0.35;
/// Least time of a stop, in lags of the amplifier.
const LAGS: f64 = 3.4;
/// Largest share of `actuator.slew_rate` for a stop: the local gain of a stack differs from its mean by a quarter.
const SLEW: f64 = 1.0 / 1.3;
/// Largest deflection of a leg by inertia, as a share of the stroke, with all axes stopping at once.
const BENT: f64 = 0.05;
/// Time of the shortest stop, in thirds of that of a stop from the largest speed.
const SHORTEST_THIRDS: i32 = 2;
/// Peak deceleration and peak jerk of a stop from unit rate in unit time.
pub(super) const PEAK: f64 = 1.5;
const SLOPE: f64 = 6.0;

/// Limits of stops, per s² and s³, m and rad, along the user's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    pub acceleration: [f64; 6],
    pub jerk: [f64; 6],
    /// Largest declared speed, per s.
    speed: [f64; 6],
}

impl Limits {
    /// The limits of the spec; those left out are derived from the platform.
    pub fn of(model: &Model, task: &TaskSpace, user: &User) -> Self {
        let rules = &task.setpoint;
        let speed: [f64; 6] = core::array::from_fn(|axis| larger(rules.stream_speed[axis], rules.speed[axis]));
        let each = |rule: &dyn Fn(f64, usize) -> f64| core::array::from_fn(|axis| rule(speed[axis], axis));
        let (acceleration, jerk) = match (rules.stop_acceleration, rules.stop_jerk) {
            (Some(acceleration), Some(jerk)) => (acceleration, jerk),
            (Some(a), None) => (a, each(&|v, axis| SLOPE / (PEAK * PEAK) * a[axis] * a[axis] / v)),
            (None, Some(j)) => (each(&|v, axis| PEAK * libm::sqrt(j[axis] * v / SLOPE)), j),
            (None, None) => {
                let time = shortest_time(model, task, user, &speed);
                (each(&|v, _| PEAK * v / time), each(&|v, _| SLOPE * v / (time * time)))
            }
        };
        Self { acceleration, jerk, speed }
    }

    /// These limits, raised as needed for a stop from `speed` (per s) within `time` (s).
    pub fn at_least(&self, speed: &[f64; 6], time: f64) -> Self {
        Self {
            acceleration: core::array::from_fn(|axis| larger(self.acceleration[axis], PEAK * speed[axis] / time)),
            jerk: core::array::from_fn(|axis| larger(self.jerk[axis], SLOPE * speed[axis] / (time * time))),
            speed: self.speed,
        }
    }

    /// The limits in the form of the controller.
    pub fn reciprocal(&self, period: f64) -> StopLimits<f64> {
        let mut limits = StopLimits {
            acceleration: self.acceleration.map(|a| 1.0 / (a * period * period)),
            jerk: self.jerk.map(|j| 1.0 / (j * period * period * period)),
            shortest: 1,
        };
        // Slow motions have room for a gentle stop.
        limits.shortest = (limits.ticks(&self.speed.map(|v| v * period)) * SHORTEST_THIRDS / 3).max(1);
        limits
    }
}

fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The time t, s, for stops from `speed` (per s, m and rad, along the user's axes).
#[allow(clippy::needless_range_loop)] // Axes and legs by number, as in the equations.
fn shortest_time(model: &Model, task: &TaskSpace, user: &User, speed: &[f64; 6]) -> f64 {
    let mut time = larger(2.0 * model.timing.period, LAGS * model.amplifier.lag);
    // A platform without dynamics is refused elsewhere.
    let Ok(platform) = lower::platform(model) else { return time };
    let rest = RestDynamics::of(&platform);
    let Some(basis) = ModalBasis::of(&rest, model.actuator.axial_stiffness) else { return time };
    time = larger(time, PERIODS * core::f64::consts::TAU / basis.frequencies[0]);
    let lead = lead(model, task, &basis);
    let Some(inverse) = lower::inverse_jacobian(&model.geometry) else { return time };
    let slew = SLEW * model.actuator.slew_rate * model.actuator.leg_gain();
    let bent = BENT * model.actuator.stroke;
    for leg in 0..6 {
        // Rate of the leg at these speeds, and its deflection at accelerations of the same numbers, all axes at once.
        let (mut rate, mut bend) = (0.0, 0.0);
        for (axis, v) in speed.iter().enumerate() {
            let column = user.column(axis);
            let moved = (0..6).fold(0.0, |sum, k| sum + rest.jacobian[leg][k] * column[k]);
            let wrench = |row: usize| (0..6).fold(0.0, |sum, k| sum + rest.mass[row][k] * column[k]);
            let force = (0..6).fold(0.0, |sum, row| sum + inverse[row][leg] * wrench(row));
            rate += moved.abs() * v;
            bend += force.abs() * v / model.actuator.axial_stiffness;
        }
        // slew = lead · acceleration + deflection by the jerk.
        let (once, twice) = (PEAK * lead * rate, SLOPE * bend);
        time = larger(time, (once + libm::sqrt(once * once + 4.0 * slew * twice)) / (2.0 * slew));
        time = larger(time, PEAK * bend / bent);
    }
    time
}
