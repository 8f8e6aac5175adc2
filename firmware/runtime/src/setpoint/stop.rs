//! Deceleration to standstill from any motion, without a step in pose or rate, inside the workspace.
//!
//! Over D ticks the rate falls as v (1 − 3σ² + 2σ³), σ = k/D, and the distance is D v/2, in the direction of v on every
//! axis. The deceleration peaks at 1.5 v/D and its slope at 6 v/D². D is the least within [`StopLimits`]. It is halved
//! while the path would leave the workspace: the workspace has priority over the limits. The acceleration of the motion
//! is dropped at once.

use super::profile::{LONGEST, largest, least};
use super::{Frames, Setpoints, Target};
use crate::real::Real;

/// Number of halvings of D: after them only a tick is left.
const HALVINGS: u32 = 21;

/// Limits of stops, per tick, reciprocal and by axis: 1/(A T_s²) and 1/(J T_s³), per m or rad; and the least duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopLimits<T> {
    /// Of deceleration.
    pub acceleration: [T; 6],
    /// Of jerk.
    pub jerk: [T; 6],
    /// Least D, ≥ 1, for slow motions.
    pub shortest: i32,
}

impl<T: Real> StopLimits<T> {
    /// D of a stop from `rate` (m and rad per tick), at most [`LONGEST`]. Each axis moves D/2 times its rate.
    #[must_use]
    pub fn ticks(&self, rate: &[T; 6]) -> i32 {
        let a = largest(rate, &self.acceleration) * T::from_f64(1.5);
        let j = largest(rate, &self.jerk) * T::from_f64(6.0);
        let known = if j > a { j } else { a };
        match least(known, |d: T| d >= a && d * d >= j) {
            Some(ticks) if ticks < self.shortest => self.shortest,
            Some(ticks) => ticks,
            None => LONGEST,
        }
    }
}

crate::state! { |words|
    /// A stop under way. Nothing to stop at reset.
    #[derive(PartialEq)]
    pub struct Stop<T>[T: Real] {
        /// Pose at its start, in the user's frames, m and rad.
        start: [T; 6] = [T::ZERO; 6], axes(words.sizes().user);
        /// Rate there, m and rad per tick.
        rate: [T; 6] = [T::ZERO; 6], axes(words.sizes().rate);
        /// D.
        ticks: i32 = 1, ticks(LONGEST) if *ticks != 0;
        /// k.
        tick: i32 = 0, ticks(LONGEST);
    }
}

impl<T: Real> Stop<T> {
    /// The stop from `pose` (m, rad) at `rate` (per s), in the user's frames.
    #[must_use]
    pub fn plan<F: Frames<T>>(setpoints: &Setpoints<T, F>, pose: &[T; 6], rate: &[T; 6]) -> Self {
        let mut stop = Self { start: *pose, rate: *rate, ticks: 1, tick: 0 };
        for rate in &mut stop.rate {
            *rate = *rate * setpoints.period;
        }
        stop.ticks = setpoints.stop.ticks(&stop.rate);
        for _ in 0..HALVINGS {
            if stop.ticks == 1 || setpoints.admitted(&stop.end()).is_some() {
                break;
            }
            stop.ticks = (stop.ticks + 1) / 2;
        }
        stop
    }

    /// Pose at its end, m and rad.
    fn end(&self) -> [T; 6] {
        let half = T::from_i32(self.ticks) * T::HALF;
        let mut end = self.start;
        for (end, rate) in end.iter_mut().zip(&self.rate) {
            *end = *end + *rate * half;
        }
        end
    }

    /// Set-point after one tick, and whether the platform has stopped.
    #[inline]
    pub(super) fn next<F>(&mut self, setpoints: &Setpoints<T, F>) -> (Target<T>, bool) {
        self.tick += 1;
        if self.tick >= self.ticks {
            return (Target::at(self.end()), true);
        }
        let d = T::from_i32(self.ticks);
        let s = T::from_i32(self.tick) / d;
        let (two, three) = (T::from_f64(2.0), T::from_f64(3.0));
        let square = s * s;
        let way = d * s * (T::ONE - square + square * s * T::HALF);
        let rate = (T::ONE - square * (three - two * s)) * setpoints.rate;
        let acceleration = -(two * three) * s * (T::ONE - s) / d * setpoints.square_rate;
        let mut target = Target::at(self.start);
        for axis in 0..6 {
            let v = self.rate[axis];
            target.pose[axis] = target.pose[axis] + v * way;
            target.rate[axis] = v * rate;
            target.acceleration[axis] = v * acceleration;
        }
        (target, false)
    }
}
