//! Leg displacements along axes, over boxes and along paths, from the kinematics that the controller uses.

use nalgebra::{Matrix6, Vector6};
use specgen_language::model::Model;
use specgen_numerics::{coupled, displacements, jacobian, largest};
use specgen_runtime::Platform;

use super::{INTERIOR_POSES, PathReach, Pose, wider};

/// Largest angle for which the kinematics is valid, rad.
const LARGEST_ANGLE: f64 = core::f64::consts::FRAC_PI_4;
/// Tolerance of the stroke, as a share of it: rounding must not refuse a path that starts at rest.
const SLACK: f64 = 1e-9;

pub(super) struct Legs<'a> {
    pub(super) platform: &'a Platform<f64>,
    pub(super) stroke: f64,
    pub(super) cross_talk: Option<&'a [[f64; 6]; 6]>,
}

impl<'a> Legs<'a> {
    pub(super) const fn of(model: &'a Model, platform: &'a Platform<f64>, stroke: f64) -> Self {
        Self { platform, stroke, cross_talk: model.actuator.cross_talk.as_ref() }
    }

    /// What each leg must extend by at a pose, cross-talk included, m.
    fn displacements(&self, pose: &Pose) -> [f64; 6] {
        coupled(self.cross_talk, displacements(self.platform, pose))
    }

    /// Slopes of these displacements, a row by leg, m/m and m/rad.
    pub(super) fn slopes(&self, pose: &Pose) -> [[f64; 6]; 6] {
        let rows = jacobian(self.platform, pose);
        let columns: [[f64; 6]; 6] =
            core::array::from_fn(|axis| coupled(self.cross_talk, core::array::from_fn(|leg| rows[leg][axis])));
        core::array::from_fn(|leg| core::array::from_fn(|axis| columns[axis][leg]))
    }

    /// Smallest and largest leg displacement at a pose, m.
    pub(super) fn span(&self, pose: &Pose) -> [f64; 2] {
        self.displacements(pose).iter().map(|x| [*x, *x]).fold([f64::INFINITY, f64::NEG_INFINITY], wider)
    }

    fn holds(&self, pose: &Pose) -> bool {
        let [low, high] = self.span(pose);
        low >= -SLACK * self.stroke && high <= (1.0 + SLACK) * self.stroke
    }

    /// The pose with every leg at half its stroke, by Newton steps from rest.
    pub(super) fn middle(&self) -> Pose {
        let mut pose = [0.0; 6];
        for _ in 0..8 {
            let missing = self.displacements(&pose).map(|x| 0.5 * self.stroke - x);
            let slopes = self.slopes(&pose);
            let rows = Matrix6::from_fn(|i, j| slopes[i][j]);
            let Some(step) = rows.lu().solve(&Vector6::from(missing)) else {
                break;
            };
            for (x, dx) in pose.iter_mut().zip(step.iter()) {
                *x += dx;
            }
        }
        pose
    }

    /// Value of `axis` at which the first leg reaches its end, moving it alone from `pose` in the direction of `sign`; its value at
    /// `pose` if a leg is beyond its ends there.
    pub(super) fn travel(&self, pose: &Pose, axis: usize, sign: f64) -> f64 {
        let moved = |by: f64| {
            let mut moved = *pose;
            moved[axis] += sign * by;
            moved
        };
        // An upper bound of the travel: the stroke over the steepest slope, doubled for the curvature.
        let slopes = self.slopes(pose);
        let steepest = slopes.iter().map(|row| row[axis].abs()).fold(0.0, |a: f64, b| if b > a { b } else { a });
        let far = 2.0 * self.stroke / steepest;
        let far = if axis >= 3 && far > LARGEST_ANGLE { LARGEST_ANGLE } else { far };
        pose[axis] + sign * largest(far, |by| self.holds(&moved(by)))
    }

    /// Scale of the box, shrunk towards `bias`, at which all corners are in reach.
    pub(super) fn share(&self, bias: &Pose, bounds: &Pose) -> f64 {
        largest(1.0, |share| {
            corners().all(|signs| {
                let corner = core::array::from_fn(|i| bias[i] + share * (signs[i] * bounds[i] - bias[i]));
                self.holds(&corner)
            })
        })
    }

    /// Largest scale, up to 1, of a box of half widths `half` about `centre` at which all corners are in reach.
    pub(super) fn corners_within(&self, centre: &Pose, half: &Pose) -> f64 {
        largest(1.0, |share| {
            corners().all(|signs| self.holds(&core::array::from_fn(|i| centre[i] + share * signs[i] * half[i])))
        })
    }

    /// Upper bound of |Δl| over the whole box. With d the motion of a joint, |Δl − s·d| ≤ |d|²/(2 (l₀ − |d|)), and
    /// |R − I − [θ]×| ≤ e^t − 1 − t with t = |θx| + |θy| + |θz|.
    pub(super) fn bound(&self, bounds: &Pose, rest_lengths: &[f64; 6], joint_radius: f64) -> f64 {
        let turn = bounds[3] + bounds[4] + bounds[5];
        let second = (libm::exp(turn) - 1.0 - turn) * joint_radius;
        let motion = bounds[0] + bounds[1] + bounds[2] + turn * joint_radius + second;
        let slopes = self.slopes(&[0.0; 6]);
        let nonlinear = rest_lengths
            .map(|length| second + if motion < length { motion * motion / (2.0 * (length - motion)) } else { motion });
        let magnitudes = self.cross_talk.map(|e| e.map(|row| row.map(f64::abs)));
        let mut largest = 0.0;
        for (row, nonlinear) in slopes.iter().zip(coupled(magnitudes.as_ref(), nonlinear)) {
            let mut linear = 0.0;
            for (slope, bound) in row.iter().zip(bounds) {
                linear += slope.abs() * bound;
            }
            let all = linear + nonlinear;
            if all > largest {
                largest = all;
            }
        }
        largest
    }

    /// Displacements along a path, and the range of possible shifts along z. The legs' slopes in z are those at rest:
    /// over the strokes of a piezo they do not change.
    pub(super) fn shift(&self, poses: impl Iterator<Item = Pose>) -> PathReach {
        let mut path = PathReach { poses: 0, displacement: [f64::INFINITY, f64::NEG_INFINITY], shift: None };
        let slopes = self.slopes(&[0.0; 6]).map(|row| row[2]);
        let (mut lowest, mut highest) = (f64::NEG_INFINITY, f64::INFINITY);
        for pose in poses {
            path.poses += 1;
            for (x, slope) in self.displacements(&pose).iter().zip(slopes) {
                // NaN counts as beyond every stroke.
                path.displacement =
                    if x.is_nan() { [f64::NEG_INFINITY, f64::INFINITY] } else { wider(path.displacement, [*x, *x]) };
                let (mut from, mut to) = (-x / slope, (self.stroke - x) / slope);
                if slope < 0.0 {
                    (from, to) = (to, from);
                }
                if from > lowest {
                    lowest = from;
                }
                if to < highest {
                    highest = to;
                }
            }
        }
        path.shift = (path.poses > 0 && lowest <= highest).then_some([lowest, highest]);
        path
    }
}

/// Signs of the 64 corners of a box.
fn corners() -> impl Iterator<Item = [f64; 6]> {
    (0..64_u32).map(|corner| core::array::from_fn(|axis| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 }))
}

/// Corners of the box, and interior poses spread evenly (Halton).
pub(super) fn samples(bounds: &Pose) -> impl Iterator<Item = Pose> {
    const PRIMES: [u32; 6] = [2, 3, 5, 7, 11, 13];
    let interior = (1..=INTERIOR_POSES).map(|k| PRIMES.map(|prime| 2.0 * radical_inverse(k, prime) - 1.0));
    let bounds = *bounds;
    corners().chain(interior).map(move |part| core::array::from_fn(|axis| part[axis] * bounds[axis]))
}

/// Digits of `k` in `base`, mirrored at the radix point.
fn radical_inverse(mut k: u32, base: u32) -> f64 {
    let (mut value, mut weight) = (0.0, 1.0);
    while k > 0 {
        weight /= f64::from(base);
        value += weight * f64::from(k % base);
        k /= base;
    }
    value
}
