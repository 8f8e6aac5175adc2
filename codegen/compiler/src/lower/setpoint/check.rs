//! Checks of every trajectory: the workspace, and the speed limit of streams.

use super::{AXES, User, amount};
use specgen_language::model::{Model, SetpointRules};

/// Place and amount of a violation by a trajectory.
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

/// Largest violations of workspace and speed, if any.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Excesses {
    pub place: Option<Worst>,
    pub speed: Option<Worst>,
}

impl Excesses {
    /// Checks one tick: the user's pose (m, rad) and rate (per s).
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

    /// Fix of a violation of the workspace, with values that the workspace check accepts.
    pub fn fix_of_place(&self, user: &User) -> Option<String> {
        let Worst { axis, value, .. } = self.place?;
        let bound = user.bound[axis];
        let beyond = if value > 0.0 { value - bound } else { value + bound };
        let (table, item) = if axis < 3 { ("translation", axis) } else { ("rotation", axis - 3) };
        let (by, to) = (outwards(axis, -beyond), outwards(axis, value.abs()));
        Some(format!(
            "change control.setpoint.bias[{axis}] by {by}, or widen workspace.{table}[{item}] to {to}, if legs and gauges reach that far"
        ))
    }

    /// Fix of a violation of speed: the control.setpoint.stream_speed that the worst axis needs.
    pub fn fix_of_speed(&self) -> Option<String> {
        let Worst { axis, value, .. } = self.speed?;
        Some(format!("raise control.setpoint.stream_speed[{axis}] to {}/s", outwards(axis, value.abs())))
    }

    /// The frequency, rounded down, at which a path of the paper is within the speed limit: its speeds are proportional to it. Sampling
    /// at ticks of `period` (s) may miss the largest speed by the cosine of half a tick's phase.
    pub fn fix_of_frequency(&self, frequency: f64, period: f64) -> Option<f64> {
        let missed = libm::cos(core::f64::consts::PI * frequency * period);
        let slower = frequency / self.speed?.excess * missed;
        let scale = libm::pow(10.0, 2.0 - libm::floor(libm::log10(slower)));
        Some(libm::floor(slower * scale) / scale)
    }

    /// Messages about place and speed.
    pub fn messages(&self, model: &Model, user: &User, rules: &SetpointRules) -> [Option<(Worst, String)>; 2] {
        let place = self.place.map(|worst| {
            let axis = worst.axis;
            let (name, value, time) = (AXES[axis], amount(axis, worst.value), worst.time);
            let bound = amount(axis, user.bound[axis]);
            let message =
                format!("{name} is {value} after {time:.6} s, bias included, outside the workspace of ±{bound}");
            (worst, message)
        });
        let speed = self.speed.map(|worst| {
            let axis = worst.axis;
            let (name, speed, time) = (AXES[axis], amount(axis, worst.value.abs()), worst.time);
            let step = amount(axis, worst.value.abs() * model.timing.period);
            let limit = amount(axis, rules.stream_speed[axis]);
            let message = format!(
                "{name} moves at {speed}/s after {time:.6} s ({step} in a tick), faster than control.setpoint.stream_speed, {limit}/s"
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
