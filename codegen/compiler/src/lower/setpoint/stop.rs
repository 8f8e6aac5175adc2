//! Limits of stops: given, or derived from what legs and amplifiers follow.
//!
//! Derived limits let a stop from the largest declared speed take the time t, and just reach both: a = 1.5 v/t, j = 6 v/t²
//! (see `specgen_runtime::setpoint::Stop`). Stops from lower speeds are shorter, but take two thirds of it at least. t is the least time in which
//! * a share of a period of the platform's lowest mode goes by: shorter stops ring with what the feed-forward of the
//!   inertia leaves, as large as the stiffness is uncertain;
//! * the amplifiers follow;
//! * what the stop adds to the rate of a leg's voltage keeps within `actuator.slew_rate`, all axes stopping at once;
//! * inertia bends no leg by more than a share of its stroke.

use specgen_runtime::setpoint::StopLimits;

use super::User;
use crate::lower;
use crate::stability::platform::{ModalBasis, RestDynamics, lead};
use specgen_language::model::{Model, TaskSpace};

/// Share of the period of the lowest mode that a stop takes at least.
const PERIODS: f64 = 0.35;
/// Time constants of the amplifier that it takes at least.
const LAGS: f64 = 3.4;
/// Share of `actuator.slew_rate` that it takes at most: the local gain of a stack differs from its mean by a quarter.
const SLEW: f64 = 1.0 / 1.3;
/// Share of the stroke by which inertia bends a leg at most, all axes stopping at once.
const BENT: f64 = 0.05;
/// Share of the time of a stop from the largest speed that the shortest one takes, over three.
const SHORTEST_THIRDS: i32 = 2;
/// Peak deceleration and peak jerk of a stop from a rate of 1 that takes a time of 1.
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
    /// What the spec gives, and for the rest what follows from the platform.
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

    /// These, raised as far as a stop from `speed` (per s) within `time` (s) takes.
    pub fn at_least(&self, speed: &[f64; 6], time: f64) -> Self {
        Self {
            acceleration: core::array::from_fn(|axis| larger(self.acceleration[axis], PEAK * speed[axis] / time)),
            jerk: core::array::from_fn(|axis| larger(self.jerk[axis], SLOPE * speed[axis] / (time * time))),
            speed: self.speed,
        }
    }

    /// As the controller has them.
    pub fn reciprocal(&self, period: f64) -> StopLimits<f64> {
        let mut limits = StopLimits {
            acceleration: self.acceleration.map(|a| 1.0 / (a * period * period)),
            jerk: self.jerk.map(|j| 1.0 / (j * period * period * period)),
            shortest: 1,
        };
        // A slow motion has the room to be stopped as gently as the legs like it.
        limits.shortest = (limits.ticks(&self.speed.map(|v| v * period)) * SHORTEST_THIRDS / 3).max(1);
        limits
    }
}

fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// t, s, for stops from `speed` (per s, m and rad, along the user's axes).
#[allow(clippy::needless_range_loop)] // Axes and legs by number, as in the equations.
fn shortest_time(model: &Model, task: &TaskSpace, user: &User, speed: &[f64; 6]) -> f64 {
    let mut time = larger(2.0 * model.timing.period, LAGS * model.amplifier.lag);
    // A platform that has no dynamics is refused elsewhere.
    let Ok(platform) = lower::platform(model) else { return time };
    let rest = RestDynamics::of(&platform);
    let Some(basis) = ModalBasis::of(&rest, model.actuator.axial_stiffness) else { return time };
    time = larger(time, PERIODS * core::f64::consts::TAU / basis.frequencies[0]);
    let lead = lead(model, task, &basis);
    let Some(inverse) = lower::inverse_jacobian(&model.geometry) else { return time };
    let slew = SLEW * model.actuator.slew_rate * model.actuator.leg_gain();
    let bent = BENT * model.actuator.stroke;
    for leg in 0..6 {
        // Rate of the leg at these speeds, and what it is bent by at accelerations of the same numbers, all axes at once.
        let (mut rate, mut bend) = (0.0, 0.0);
        for (axis, v) in speed.iter().enumerate() {
            let column = user.column(axis);
            let moved = (0..6).fold(0.0, |sum, k| sum + rest.jacobian[leg][k] * column[k]);
            let wrench = |row: usize| (0..6).fold(0.0, |sum, k| sum + rest.mass[row][k] * column[k]);
            let force = (0..6).fold(0.0, |sum, row| sum + inverse[row][leg] * wrench(row));
            rate += moved.abs() * v;
            bend += force.abs() * v / model.actuator.axial_stiffness;
        }
        // slew = lead · acceleration + bending by the jerk.
        let (once, twice) = (PEAK * lead * rate, SLOPE * bend);
        time = larger(time, (once + libm::sqrt(once * once + 4.0 * slew * twice)) / (2.0 * slew));
        time = larger(time, PEAK * bend / bent);
    }
    time
}
