//! A step without a corner in its speed.

use std::f64::consts::TAU;

use super::{PoseTarget, PoseTrajectory};

/// From zero to a pose: h = to (u − sin(2π u)/(2π)), u = t/T from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Step {
    /// m and rad.
    pub to: [f64; 6],
    /// T, s.
    pub time: f64,
}

impl PoseTrajectory for Step {
    fn duration(&self) -> f64 {
        self.time
    }

    fn target(&self, time: f64) -> PoseTarget {
        if time >= self.time {
            return PoseTarget { pose: self.to, ..PoseTarget::default() };
        }
        let turn = TAU * time / self.time;
        let (s, c) = (libm::sin(turn), libm::cos(turn));
        PoseTarget {
            pose: self.to.map(|to| to * (turn - s) / TAU),
            rate: self.to.map(|to| to * (1.0 - c) / self.time),
            acceleration: self.to.map(|to| to * TAU * s / (self.time * self.time)),
        }
    }
}
