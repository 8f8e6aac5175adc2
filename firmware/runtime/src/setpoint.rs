//! Set-points: the pose at the end of the next interval, and the motion there.
//!
//! | part | what |
//! |---|---|
//! | [`Generator`] | bias, hold, stream, move, trajectory; what is refused, and how a motion ends early |
//! | [`Profile`] | jerk-limited motion from rest to rest |
//! | [`Stop`] | to standstill from any motion |
//! | [`Trajectory`] | prepared motions: segments of polynomial and sinusoid, tables with cubic splines |
//! | [`Frames`] | work and tool coordinates of the user to coordinates of the platform |
//!
//! Coordinates h = [x y z θx θy θz] from rest: P_C in the base frame (m) and the angles of R = Rz Ry Rx (rad). Rates
//! and accelerations are the time derivatives of these six numbers. Each piece of a path has analytic derivatives: a
//! finite difference would put an impulse into the force feed-forward at every corner.

mod frames;
mod generator;
mod profile;
mod stop;
mod trajectory;

use crate::choice::choice;
use crate::linear::is_within;
use crate::real::Real;

pub use crate::motion::Motion as Target;
pub use frames::{Frames, Parallel, Tool, Work};
pub use generator::{BUSY, Generator, REFUSED, STALE};
pub use profile::{LONGEST, MoveLimits, Profile};
pub use stop::{Stop, StopLimits};
pub use trajectory::{Axis, Row, Segment, Table, Trajectory};

choice! {
    /// Kind of a command.
    pub enum CommandKind or Unknown {
        /// Hold the present set-point.
        Hold = 0,
        /// Follow the streamed set-points.
        Stream = 1,
        /// Go to the pose of [`Command::target`].
        Move = 2,
        /// Play the trajectory [`Command::selector`].
        Trajectory = 3,
        /// The numbers of the set-point are the voltages of the legs, V: in an open drive only.
        Drive = 4,
        /// Any other value: refused, and the platform holds.
        Unknown = 5,
    }
}

/// A command. It applies to every tick in which it is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command<T: Real> {
    /// What.
    pub kind: CommandKind,
    /// Index of the trajectory.
    pub selector: u32,
    /// Counter of streamed set-points: a new value marks a fresh one.
    pub sequence: u32,
    /// Streamed set-point at the end of the next interval, or the pose of a move; in the user's frames.
    pub target: Target<T>,
}

/// Constants of set-points, from the spec.
#[derive(Debug, Clone, Copy)]
pub struct Setpoints<T: Real, F> {
    /// T_s, s.
    pub period: T,
    /// 1/T_s, 1/s.
    pub rate: T,
    /// 1/T_s², 1/s².
    pub square_rate: T,
    /// Pose that is added to every set-point, m and rad.
    pub bias: [T; 6],
    /// The user's coordinates of that pose.
    pub home: [T; 6],
    /// Largest |pose component| of a set-point, the bias included, m and rad.
    pub bound: [T; 6],
    /// Limits of bias and moves.
    pub limits: MoveLimits<T>,
    /// Limits of stops.
    pub stop: StopLimits<T>,
    /// Largest step of a stream in a tick, m and rad.
    pub stream_step: [T; 6],
    /// Largest rate that a stream may state, m/s and rad/s.
    pub stream_rate: [T; 6],
    /// Largest acceleration that a stream may state, m/s² and rad/s².
    pub stream_acceleration: [T; 6],
    /// Ticks without a fresh set-point after which a stream is stale, ≥ 1.
    pub stale_ticks: u32,
    /// The user's frames.
    pub frames: F,
    /// Prepared motions by [`Command::selector`].
    pub trajectories: &'static [Trajectory<T>],
}

impl<T: Real, F> Setpoints<T, F> {
    /// Whether a pose of the platform, with the bias, is finite and within the workspace.
    #[must_use]
    pub fn reaches(&self, pose: &[T; 6]) -> bool {
        is_within(pose, &self.bound)
    }
}

impl<T: Real, F: Frames<T>> Setpoints<T, F> {
    /// Writes the user's set-point in platform coordinates into `target`, if it is finite and within the workspace.
    #[inline]
    pub fn admit(&self, user: &Target<T>, target: &mut Target<T>) -> bool {
        self.frames.admit(user, &self.bias, &self.bound, target)
    }

    /// The user's pose in platform coordinates, if it is finite and within the workspace.
    #[must_use]
    pub fn admitted(&self, user: &[T; 6]) -> Option<[T; 6]> {
        let mut target = Target::new();
        self.admit(&Target::at(*user), &mut target).then_some(target.pose)
    }
}
