//! Largest rates and accelerations of set-points along the platform's own axes.

use super::User;
use super::stop::PEAK;
use crate::ir::{Frames, Path, Row, Segment, Setpoints};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TaskSpace};
use specgen_numerics::norm;

/// Largest ratio of the rate of an angle to the angular rate of the platform, for angles up to [`super::TURNED`].
const TURNS: f64 = 1.1;

/// Largest rates and accelerations of the six coordinates, m and rad, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::lower) struct Motions {
    pub rate: [f64; 6],
    pub acceleration: [f64; 6],
}

/// The motions of moves and trajectories; of stops from any declared speed; of any permitted stream, also when a bound stops it.
///
/// # Errors
/// Frames that [`super::lower`] refuses.
pub(in crate::lower) fn largest(
    model: &Model,
    task: &TaskSpace,
    setpoints: &Setpoints,
) -> Result<[Motions; 3], Vec<Diagnostic>> {
    let user = User::of(model, task)?;
    let rules = &task.setpoint;
    let mut tracked = Motions { rate: rules.speed, acceleration: rules.acceleration };
    for trajectory in &setpoints.trajectories {
        match &trajectory.path {
            Path::Segments { segments, .. } => {
                segments.iter().for_each(|segment| tracked.take_in(&of_segment(segment)))
            }
            Path::Table { rows, per_second, .. } => {
                rows.windows(2).for_each(|pair| tracked.take_in(&of_rows(&pair[0], &pair[1], *per_second)));
            }
        }
    }
    let period = model.timing.period;
    let mut stops = tracked;
    let acceleration = setpoints.stop_acceleration_limit.map(|limit| 1.0 / (limit * period * period));
    stops.take_in(&Motions { rate: rules.stream_speed, acceleration });
    let mut streams = stops;
    let acceleration = rules.stream_speed.map(|speed| PEAK * speed / period);
    streams.take_in(&Motions { rate: rules.stream_speed, acceleration });
    Ok([tracked, stops, streams].map(|motions| motions.of_platform(&user.frames)))
}

impl Motions {
    fn take_in(&mut self, other: &Self) {
        let own = self.rate.iter_mut().chain(&mut self.acceleration);
        for (own, other) in own.zip(other.rate.iter().chain(&other.acceleration)) {
            if *other > *own {
                *own = *other;
            }
        }
    }

    /// From the user's axes to an upper bound along those of the platform.
    fn of_platform(self, frames: &Frames) -> Self {
        let (point, turned) = match frames {
            Frames::Parallel => return self,
            Frames::Tool { point, .. } => (norm(*point), false),
            Frames::Work { point, .. } => (norm(*point), true),
        };
        let (rate, acceleration) = (&self.rate, &self.acceleration);
        // ω = Σ θ̇_k e_k with unit vectors e_k that turn no faster than ω: |ω| ≤ Σ|θ̇|, |ω̇| ≤ Σ|θ̈| + ω².
        let turn = rate[3] + rate[4] + rate[5];
        let spin = acceleration[3] + acceleration[4] + acceleration[5] + turn * turn;
        // P_C = tool point − R p.
        let moved =
            |along: &[f64; 6], axis: usize| if turned { norm([along[0], along[1], along[2]]) } else { along[axis] };
        let rate_of = |axis: usize| match axis {
            0..3 => moved(rate, axis) + turn * point,
            _ if turned => TURNS * turn,
            _ => rate[axis],
        };
        let acceleration_of = |axis: usize| match axis {
            0..3 => moved(acceleration, axis) + (spin + turn * turn) * point,
            // θ̈ = T⁻¹(ω̇ − Ṫ θ̇), |Ṫ θ̇| ≤ Σ|θ̇| ω.
            _ if turned => TURNS * (spin + 3.0 * TURNS * turn * turn),
            _ => acceleration[axis],
        };
        Self { rate: core::array::from_fn(rate_of), acceleration: core::array::from_fn(acceleration_of) }
    }
}

/// h = p + q w + (a + b w) S + (c + d w) C, w = 0..1.
fn of_segment(segment: &Segment) -> Motions {
    let (speed, angular) = (segment.per_second, segment.angular);
    let of = |axis: usize| {
        let axis = &segment.axes[axis];
        let [[a, b], [c, d]] = [axis.sine, axis.cosine].map(|pair| pair.map(f64::abs));
        let growth = (b + d) * speed;
        let swing = (a + b + c + d) * angular;
        [axis.slope.abs() * speed + growth + swing, (2.0 * growth + swing) * angular]
    };
    Motions { rate: core::array::from_fn(|axis| of(axis)[0]), acceleration: core::array::from_fn(|axis| of(axis)[1]) }
}

/// A cubic from row to row: its second derivative is between those at its ends.
fn of_rows(from: &Row, to: &Row, per_second: f64) -> Motions {
    let bend = |axis: usize| [from.bend[axis].abs(), to.bend[axis].abs()];
    Motions {
        rate: core::array::from_fn(|axis| {
            let [a, b] = bend(axis);
            ((to.pose[axis] - from.pose[axis]).abs() + 2.0 * (a + b)) * per_second
        }),
        acceleration: core::array::from_fn(|axis| {
            let [a, b] = bend(axis);
            6.0 * if a > b { a } else { b } * per_second * per_second
        }),
    }
}
