//! Stopping distances of the platform from every declared speed, and the check that stops end within workspace and strokes.

mod refusal;

use serde::Serialize;
use specgen_numerics::{coupled, displacements};
use specgen_runtime::Platform;
use specgen_runtime::setpoint::StopLimits;

use super::poses::{Stretch, along};
use super::{AXES, User, amount, stop};
use crate::ir::Setpoints;
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TaskSpace};
use specgen_numerics::largest;

/// Tolerance for trajectories up to the bound of the workspace: a stop close to a bound is shortened while it runs.
const SLACK: f64 = 0.01;
/// Least room of an axis, as a share of the workspace. Rounding gives this much to a leg at the end of its stroke.
const LEAST_ROOM: f64 = 1e-6;

/// The longest stop of one kind of motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stopping {
    /// `stream`, `move`, or the trajectory's name.
    pub what: String,
    /// Largest speed of each axis, m/s and rad/s.
    pub speed: [f64; 6],
    /// Distance that a stream coasts until it counts as stale, m and rad.
    pub coasted: [f64; 6],
    /// Longest time from there to standstill, s.
    pub time: f64,
    /// Longest distance of the set-point from there to standstill, m and rad.
    pub way: [f64; 6],
    /// Possible overshoot of the platform beyond the set-point, due to its lag, m and rad.
    pub overshoot: [f64; 6],
}

/// Parameters that determine the length of a stop.
struct Conditions {
    limits: StopLimits<f64>,
    period: f64,
    /// Lag of the amplifiers, s.
    lag: f64,
}

impl Stopping {
    /// All axes at their speeds at once.
    fn at(what: &str, conditions: &Conditions, speed: [f64; 6], coasting: f64) -> Self {
        let Conditions { limits, period, lag } = conditions;
        let time = f64::from(limits.ticks(&speed.map(|v| v * period))) * period;
        let over = |time: f64| speed.map(|v| v * time);
        let (coasted, way, overshoot) = (over(coasting), over(0.5 * time), over(*lag));
        Self { what: what.to_owned(), speed, coasted, time, way, overshoot }
    }

    /// The part of the distance that no limit of stops shortens.
    fn fixed(&self, axis: usize) -> f64 {
        self.coasted[axis] + self.overshoot[axis]
    }

    fn distance(&self, axis: usize) -> f64 {
        self.fixed(axis) + self.way[axis]
    }
}

/// The stops of `model`, whose `[control]` is `task`: of streams, of moves, of each trajectory. `stroke`: travel of every leg, m.
///
/// # Errors
/// A stop that ends outside workspace or strokes: of a stream or a move along an axis from the bias pose, in the direction with
/// more room; of a trajectory at any of its ticks.
pub fn check(
    model: &Model,
    task: &TaskSpace,
    setpoints: &Setpoints,
    platform: &Platform<f64>,
    stroke: f64,
) -> Result<Vec<Stopping>, Vec<Diagnostic>> {
    let user = User::of(model, task)?;
    let declared = stop::Limits::of(model, task, &user);
    let period = model.timing.period;
    let conditions = Conditions { limits: declared.reciprocal(period), period, lag: model.amplifier.lag };
    let place = Place { user: &user, platform, stroke, cross_talk: model.actuator.cross_talk.as_ref() };
    let mut findings = Vec::new();
    let mut stops = Vec::new();
    let rules = &task.setpoint;
    let coasting = f64::from(rules.stale_ticks.saturating_sub(1)) * period;
    for (what, key, speed, coasting) in
        [("stream", "stream_speed", rules.stream_speed, coasting), ("move", "speed", rules.speed, 0.0)]
    {
        let stop = Stopping::at(what, &conditions, speed, coasting);
        let room = core::array::from_fn(|axis| place.room(axis));
        findings.extend(refusal::too_long(model, &stop, &room, key, &declared));
        stops.push(stop);
    }
    for (index, trajectory) in task.trajectories.iter().enumerate() {
        let Some(lowered) = setpoints.trajectories.get(index) else { continue };
        let mut longest = Stopping::at(&trajectory.name, &conditions, [0.0; 6], 0.0);
        let mut worst: Option<Leaves> = None;
        for stretch in along(&trajectory.kind, &lowered.path) {
            for (pose, rate) in rates(&stretch) {
                let stop = Stopping::at("", &conditions, rate, 0.0);
                longest.include(&stop);
                keep(&mut worst, place.leaves(&pose, &stop));
            }
        }
        findings.extend(worst.map(|leaves| refusal::leaves(model, index, &trajectory.name, &trajectory.kind, &leaves)));
        stops.push(longest);
    }
    if findings.is_empty() { Ok(stops) } else { Err(findings) }
}

impl Stopping {
    fn include(&mut self, other: &Self) {
        let larger = |slot: &mut f64, value: f64| {
            if value > *slot {
                *slot = value;
            }
        };
        larger(&mut self.time, other.time);
        for axis in 0..6 {
            larger(&mut self.speed[axis], other.speed[axis].abs());
            larger(&mut self.way[axis], other.way[axis].abs());
            larger(&mut self.overshoot[axis], other.overshoot[axis].abs());
        }
    }
}

/// Poses of a stretch in the user's coordinates with their rates.
fn rates(stretch: &Stretch) -> impl Iterator<Item = ([f64; 6], [f64; 6])> + '_ {
    let rate = |pair: &[[f64; 6]]| core::array::from_fn(|axis| (pair[1][axis] - pair[0][axis]) / stretch.interval);
    stretch.poses.windows(2).map(move |pair| (pair[1], rate(pair)))
}

/// A stop of a trajectory that would end outside.
struct Leaves {
    /// Share of the stop's distance that is inside.
    share: f64,
    /// The place in words.
    end: String,
}

fn keep(slot: &mut Option<Leaves>, found: Option<Leaves>) {
    if let Some(found) = found
        && slot.as_ref().is_none_or(|old| found.share < old.share)
    {
        *slot = Some(found);
    }
}

/// Workspace and strokes.
struct Place<'a> {
    user: &'a User,
    platform: &'a Platform<f64>,
    stroke: f64,
    cross_talk: Option<&'a [[f64; 6]; 6]>,
}

impl Place<'_> {
    /// Whether a user's pose is in the workspace and every leg in its stroke, with `slack` as a share of either.
    fn holds(&self, pose: [f64; 6], slack: f64) -> bool {
        let Some(there) = self.user.pose(pose) else { return false };
        let inside = there.iter().zip(&self.user.bound).all(|(value, bound)| value.abs() <= (1.0 + slack) * bound);
        let [low, high] = [-slack * self.stroke, (1.0 + slack) * self.stroke];
        let legs = coupled(self.cross_talk, displacements(self.platform, &there));
        inside && legs.iter().all(|leg| *leg >= low && *leg <= high)
    }

    /// Room of the user's axis alone from the bias pose in its better direction, m or rad; 0 if it is only rounding.
    fn room(&self, axis: usize) -> f64 {
        let group = if axis < 3 { 0..3 } else { 3..6 };
        let far = 4.0 * self.user.bound[group].iter().sum::<f64>();
        let [forth, back] = [1.0, -1.0].map(|sign| {
            largest(far, |by| {
                let mut pose = self.user.home;
                pose[axis] += sign * by;
                self.holds(pose, 1e-9)
            })
        });
        let room = if back > forth { back } else { forth };
        if room > LEAST_ROOM * far { room } else { 0.0 }
    }

    /// The stop from a pose of a trajectory, if it ends outside.
    fn leaves(&self, pose: &[f64; 6], stop: &Stopping) -> Option<Leaves> {
        let after = |share: f64| core::array::from_fn(|axis| pose[axis] + share * stop.distance(axis));
        let end: [f64; 6] = after(1.0);
        if self.holds(end, SLACK) {
            return None;
        }
        let share = largest(1.0, |share| self.holds(after(share), SLACK));
        let end = match self.user.outside(end) {
            Some((axis, value)) => format!("{} at {}, outside the workspace", AXES[axis], amount(axis, value)),
            None => "a leg beyond its stroke".to_owned(),
        };
        Some(Leaves { share, end })
    }
}

/// The stops as text for `specgen check`.
#[must_use]
pub fn describe(stops: &[Stopping]) -> String {
    let list = |values: &[f64; 6], scale: f64, digits: usize| {
        let each =
            |values: &[f64]| values.iter().map(|v| format!("{:.digits$}", v * scale)).collect::<Vec<_>>().join("/");
        format!("{} {}", each(&values[..3]), each(&values[3..]))
    };
    let mut text = "  stops, um and urad by axis:\n".to_owned();
    for stop in stops {
        let coasted = if stop.coasted == [0.0; 6] {
            String::new()
        } else {
            format!("{} until it counts as stale, then ", list(&stop.coasted, 1e6, 2))
        };
        let (what, speed, way) = (&stop.what, list(&stop.speed, 1e3, 3), list(&stop.way, 1e6, 2));
        let (milliseconds, overshoot) = (stop.time * 1e3, list(&stop.overshoot, 1e6, 2));
        text += &format!(
            "    {what:<9} at {speed} per ms: {coasted}{way} in {milliseconds:.1} ms; the platform up to {overshoot} further\n"
        );
    }
    text
}
