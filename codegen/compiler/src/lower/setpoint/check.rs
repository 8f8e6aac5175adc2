//! What every trajectory must keep: the workspace, and the speed that a stream may have.

use super::{AXES, User, amount};
use specgen_language::model::{Model, SetpointRules};

/// Where and by how much a trajectory breaks a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Worst {
    /// s from the start.
    pub time: f64,
    axis: usize,
    /// m or rad (per s).
    value: f64,
    /// Value over its bound.
    excess: f64,
}

/// Largest excesses over workspace and speed, as far as there are any.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Excesses {
    pub place: Option<Worst>,
    pub speed: Option<Worst>,
}

impl Excesses {
    /// Looks at one tick: the user's pose (m, rad) and rate (per s).
    pub fn look(&mut self, user: &User, rules: &SetpointRules, time: f64, pose: [f64; 6], rate: [f64; 6]) {
        if let Some((axis, value)) = user.outside(pose) {
            let excess = value.abs() / user.bound[axis];
            keep(&mut self.place, Worst { time, axis, value, excess });
        }
        for (axis, value) in rate.into_iter().enumerate() {
            let excess = value.abs() / rules.stream_speed[axis];
            if excess > 1.0 {
                keep(&mut self.speed, Worst { time, axis, value, excess });
            }
        }
    }

    /// How the place can be fixed: numbers that are themselves accepted, as far as the workspace is concerned.
    pub fn fix_of_place(&self, user: &User) -> Option<String> {
        let Worst { axis, value, .. } = self.place?;
        let bound = user.bound[axis];
        let beyond = if value > 0.0 { value - bound } else { value + bound };
        let (table, item) = if axis < 3 { ("translation", axis) } else { ("rotation", axis - 3) };
        Some(format!(
            "change control.setpoint.bias[{axis}] by {}, or widen workspace.{table}[{item}] to {}, as far as legs and gauges reach",
            outwards(axis, -beyond),
            outwards(axis, value.abs())
        ))
    }

    /// Speed that control.setpoint.stream_speed would have to permit on the worst axis, with its key.
    pub fn fix_of_speed(&self) -> Option<String> {
        let Worst { axis, value, .. } = self.speed?;
        Some(format!("raise control.setpoint.stream_speed[{axis}] to {}/s", outwards(axis, value.abs())))
    }

    /// The frequency at which a path of the paper, whose speeds go with it, is within the speed; rounded down. Seen at
    /// ticks of `period` (s), the largest speed may be missed by the cosine of half a tick's phase.
    pub fn fix_of_frequency(&self, frequency: f64, period: f64) -> Option<f64> {
        let missed = libm::cos(core::f64::consts::PI * frequency * period);
        let slower = frequency / self.speed?.excess * missed;
        let scale = libm::pow(10.0, 2.0 - libm::floor(libm::log10(slower)));
        Some(libm::floor(slower * scale) / scale)
    }

    /// What is wrong with place and speed, in words.
    pub fn messages(&self, model: &Model, user: &User, rules: &SetpointRules) -> [Option<(Worst, String)>; 2] {
        let place = self.place.map(|worst| {
            let axis = worst.axis;
            let message = format!(
                "it puts {} at {} after {:.6} s, outside the workspace of ±{}, the bias included",
                AXES[axis],
                amount(axis, worst.value),
                worst.time,
                amount(axis, user.bound[axis])
            );
            (worst, message)
        });
        let speed = self.speed.map(|worst| {
            let axis = worst.axis;
            let message = format!(
                "{} moves at {}/s after {:.6} s ({} in a tick), faster than control.setpoint.stream_speed, {}/s",
                AXES[axis],
                amount(axis, worst.value.abs()),
                worst.time,
                amount(axis, worst.value.abs() * model.timing.period),
                amount(axis, rules.stream_speed[axis])
            );
            (worst, message)
        });
        [place, speed]
    }
}

/// A length in µm or an angle in µrad, rounded away from zero to a hundredth.
fn outwards(axis: usize, value: f64) -> String {
    let hundredths = libm::ceil(value.abs() * 1e8);
    let sign = if value < 0.0 { "-" } else { "" };
    format!("{sign}{} {}", hundredths / 100.0, if axis < 3 { "um" } else { "urad" })
}

fn keep(slot: &mut Option<Worst>, worst: Worst) {
    if slot.is_none_or(|old| worst.excess > old.excess) {
        *slot = Some(worst);
    }
}
