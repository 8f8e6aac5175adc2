//! The largest boxes of reachable poses about the middle of the strokes.

use serde::Serialize;

use super::Pose;
use super::travel::Legs;

/// Steps towards the box of largest volume; a hundredth of them leaves less than a thousandth to gain.
const STEPS: u32 = 2000;

/// Half widths, m and rad, of boxes whose corners are all reachable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Boxes {
    /// Centre of the boxes: the middle of the strokes, from rest.
    pub centre: Pose,
    /// The box with the shape of the declared workspace.
    pub as_declared: Pose,
    /// The box of largest volume in all six coordinates.
    pub largest: Pose,
    /// The box of largest volume without rotation.
    pub without_rotation: Pose,
}

impl Boxes {
    pub(super) fn of(legs: &Legs<'_>, centre: Pose, declared: &Pose) -> Self {
        let slopes = legs.slopes(&centre).map(|row| row.map(f64::abs));
        // Linear legs would reach `half`; the exact corners reach a share of it.
        let fitted = |half: Pose| {
            let share = legs.corners_within(&centre, &half);
            half.map(|width| width * share)
        };
        // Scales the declared shape to where the linear legs end.
        let furthest = slopes.iter().map(|row| row.iter().zip(declared).fold(0.0, |sum, (a, b)| sum + a * b));
        let furthest = furthest.fold(0.0, |a: f64, b| if b > a { b } else { a });
        let scale = if furthest > 0.0 { 0.5 * legs.stroke / furthest } else { 0.0 };
        Self {
            centre,
            as_declared: fitted(declared.map(|bound| bound * scale)),
            largest: fitted(largest(&slopes, legs.stroke, 6)),
            without_rotation: fitted(largest(&slopes, legs.stroke, 3)),
        }
    }
}

/// Half widths w of the first `axes` coordinates that make Π w largest under Σ |J_ij| w_j ≤ stroke/2 for every leg i.
///
/// The optimum is w_j = 1/Σ λ_i |J_ij| with shares λ of the legs; each step increases the share of legs beyond their stroke.
fn largest(slopes: &[[f64; 6]; 6], stroke: f64, axes: usize) -> Pose {
    let mut shares = [1.0; 6];
    let mut widths = [0.0; 6];
    for _ in 0..STEPS {
        for (axis, width) in widths.iter_mut().enumerate().take(axes) {
            let sum = (0..6).fold(0.0, |sum, leg| sum + shares[leg] * slopes[leg][axis]);
            *width = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        }
        for (share, row) in shares.iter_mut().zip(slopes) {
            let motion = row.iter().zip(&widths).fold(0.0, |sum, (slope, width)| sum + slope * width);
            *share *= motion;
        }
        // At the optimum every active leg moves by 1, and Σ λ_i is the number of axes.
        let sum = shares.iter().fold(0.0, |sum, share| sum + share);
        shares = shares.map(|share| share * axes as f64 / sum);
    }
    let furthest = slopes
        .iter()
        .map(|row| row.iter().zip(&widths).fold(0.0, |sum, (slope, width)| sum + slope * width))
        .fold(0.0, |a: f64, b| if b > a { b } else { a });
    widths.map(|width| if furthest > 0.0 { width * 0.5 * stroke / furthest } else { 0.0 })
}
