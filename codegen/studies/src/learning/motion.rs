//! A pass of a motion, tick by tick, starting and ending at rest in the same pose.

use std::ops::Range;

use host_sim::closed_loop::{RunError, ticks_within};
use host_sim::trajectory::{PoseTarget, PoseTrajectory};

/// Rest before and after the motion, and after the return, s: preparation before the start and ringing after the end are learned as well.
const BEFORE: f64 = 0.05;
const AFTER: f64 = 0.1;
/// Shortest return to the start of the motion, s.
const BACK: f64 = 0.2;
/// Largest slope of a move from rest to rest, normalised to length and time.
const SLOPE: f64 = 1.875;

/// A pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Set-points at the end of each tick, in the user's frames.
    pub targets: Vec<PoseTarget>,
    /// Ticks of the motion itself.
    pub scored: Range<usize>,
    /// Number of ticks that a correction may cover: the motion, and the rest before and after it.
    pub corrected: usize,
    /// Radius of the platform's joints, m, by which angles are multiplied.
    pub radius: f64,
    /// Length of a tick, s.
    pub interval: f64,
}

impl Motion {
    /// A pass of a trajectory, sampled at intervals (s), with a return no faster than `speed` (m/s and rad/s of each axis); `radius` in m.
    ///
    /// # Errors
    /// If it has no ticks, or too many.
    pub fn of(trajectory: &dyn PoseTrajectory, interval: f64, speed: &[f64; 6], radius: f64) -> Result<Self, RunError> {
        let [before, after] = [BEFORE, AFTER].map(|time| libm::round(time / interval) as usize);
        let ticks = ticks_within(trajectory.duration(), interval)?;
        let at = |target: PoseTarget| PoseTarget { pose: target.pose, ..PoseTarget::default() };
        let start = at(trajectory.target(0.0));
        let mut targets = vec![start; before];
        targets.extend((1..=ticks).map(|tick| trajectory.target(tick as f64 * interval)));
        let scored = before..before + ticks;
        let end = at(targets[scored.end - 1]);
        targets.extend(std::iter::repeat_n(end, after));
        let corrected = targets.len();
        let way: [f64; 6] = std::array::from_fn(|axis| start.pose[axis] - end.pose[axis]);
        let time = way.iter().zip(speed).fold(BACK, |time, (way, speed)| {
            let needed = SLOPE * way.abs() / speed;
            if needed > time { needed } else { time }
        });
        let ticks = ticks_within(time, interval)?;
        let time = ticks as f64 * interval;
        targets.extend((1..=ticks).map(|tick| {
            let u = tick as f64 / ticks as f64;
            let rest = 1.0 - u;
            let place = u * u * u * (10.0 - u * (15.0 - 6.0 * u));
            let (rate, bend) = (30.0 * u * u * rest * rest / time, 60.0 * u * rest * (rest - u) / (time * time));
            PoseTarget {
                pose: std::array::from_fn(|axis| end.pose[axis] + way[axis] * place),
                rate: way.map(|way| way * rate),
                acceleration: way.map(|way| way * bend),
            }
        }));
        targets.extend(std::iter::repeat_n(start, after));
        Ok(Self { targets, scored, corrected, radius, interval })
    }
}
