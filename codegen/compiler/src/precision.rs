//! Rounding errors of the controller's scalar: of leg displacements and of the measured pose, in nanometres per axis, by analysis and
//! by sampling.
//!
//! The analysis runs the controller's own kernels on numbers that record every rounding ([`specgen_numerics::TracedNumber`]), over
//! the whole workspace in 64 parts. The sampling runs them in the controller's scalar at corners and random poses of the workspace
//! and compares with the same kernels on 106 bits ([`specgen_numerics::Double`]) with constants, series and passes that are exact
//! there. Both include the rounding of constants and truncated terms and steps. Not included: the set-point generator, calibration
//! of gauges, and the inverse of the hysteresis, whose voltage leaves the controller in steps of the converter.

mod kinematics;
mod sensing;
mod table;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};
use serde::Serialize;

use crate::ir::{Ir, Scalar};
use crate::lower::PoseNoise;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;

pub use table::{Row, describe, rows};

/// Random poses in addition to the corners of the workspace.
const SAMPLES: usize = 3000;

/// Errors of the chosen scalar, m and rad, in the order x, y, z, θx, θy, θz.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Precision {
    /// Errors of each leg displacement.
    pub legs: Figures,
    /// Errors of the commanded pose.
    pub commanded: Figures,
    /// Errors of the pose computed from the readings of gauges on the platform.
    pub measured: Option<Figures>,
}

/// Largest error of six numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Proven bound over the declared workspace.
    pub bound: [f64; 6],
    /// Largest sampled difference from 106 bits.
    pub sampled: [f64; 6],
    /// Largest sampled difference from doubles; none if the controller computes in doubles.
    pub against_f64: Option<[f64; 6]>,
}

impl Figures {
    /// Figures before any sample. `single`: also compare with doubles.
    fn none(bound: [f64; 6], single: bool) -> Self {
        Self { bound, sampled: [0.0; 6], against_f64: single.then_some([0.0; 6]) }
    }

    /// Bound over largest sample of each number; none if all samples are exact.
    pub fn ratio(&self) -> [Option<f64>; 6] {
        core::array::from_fn(|k| (self.sampled[k] > 0.0).then(|| self.bound[k] / self.sampled[k]))
    }
}

/// Largest magnitudes so far.
fn keep(largest: &mut [f64; 6], errors: [f64; 6]) {
    for (largest, error) in largest.iter_mut().zip(errors) {
        if error.abs() > *largest {
            *largest = error.abs();
        }
    }
}

/// Precision of the controller of `model` with the constants `ir`.
///
/// # Errors
/// As lowering: none for a model that was lowered.
pub fn of(model: &Model, ir: &Ir) -> Result<Precision, Vec<Diagnostic>> {
    tried(model, ir, 0, SAMPLES)
}

/// The same without random poses: bounds, and samples at the corners of the workspace.
///
/// # Errors
/// As [`of`].
pub fn bounds(model: &Model, ir: &Ir) -> Result<Precision, Vec<Diagnostic>> {
    tried(model, ir, 0, 0)
}

/// The same with `samples` random poses from `seed` in addition to the corners.
///
/// # Errors
/// As [`of`].
pub fn tried(model: &Model, ir: &Ir, seed: u64, samples: usize) -> Result<Precision, Vec<Diagnostic>> {
    let poses = poses(model, ir.scalar, seed, samples);
    let (legs, commanded) = kinematics::figures(model, &ir.kinematics, ir.scalar, &poses);
    let measured = match (&model.task_space, &ir.task_space) {
        (Some(task), Some(lowered)) => {
            Some(sensing::figures(model, task, &ir.kinematics, &lowered.sensing, ir.scalar, &poses)?)
        }
        _ => None,
    };
    Ok(Precision { legs, commanded, measured })
}

/// Corners of the workspace and seeded random poses in it, as numbers of the scalar.
fn poses(model: &Model, scalar: Scalar, seed: u64, samples: usize) -> Vec<[f64; 6]> {
    let bounds = model.workspace.bounds();
    let corners = (0..64_u32)
        .map(|corner| core::array::from_fn(|axis| if corner >> axis & 1 == 0 { -bounds[axis] } else { bounds[axis] }));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let inside = (0..samples)
        .map(|_| bounds.map(|bound| bound * (2.0 * f64::from(random.next_u32()) / f64::from(u32::MAX) - 1.0)))
        .collect::<Vec<[f64; 6]>>();
    corners.chain(inside).map(|pose: [f64; 6]| pose.map(|value| scalar.round(value))).collect()
}

/// The 64 parts of the workspace in which no coordinate changes its sign.
fn boxes(bounds: &[f64; 6]) -> impl Iterator<Item = [[f64; 2]; 6]> {
    (0..64_u32).map(|part| {
        core::array::from_fn(|axis| if part >> axis & 1 == 0 { [-bounds[axis], 0.0] } else { [0.0, bounds[axis]] })
    })
}

/// Warns about rounding errors beyond the noise of the gauges: another scalar would control better.
pub fn findings(model: &Model, precision: &Precision, noise: Option<&PoseNoise>) -> Vec<Diagnostic> {
    let (Some(noise), Some(measured)) = (noise, &precision.measured) else { return Vec::new() };
    let total = |axis: usize| measured.bound[axis] + precision.commanded.bound[axis];
    let worst =
        (0..6).fold(
            0,
            |worst, axis| {
                if total(axis) / noise.pose[axis] > total(worst) / noise.pose[worst] { axis } else { worst }
            },
        );
    if noise.pose[worst] == 0.0 || total(worst) <= noise.pose[worst] {
        return Vec::new();
    }
    let unit = if worst < 3 { "nm" } else { "nrad" };
    let (axis, error) = (["x", "y", "z", "theta_x", "theta_y", "theta_z"][worst], total(worst) * 1e9);
    let rms = noise.pose[worst] * 1e9;
    vec![Diagnostic::at(
        &model.spans,
        &["controller.scalar", "controller"],
        codes::PRECISION_POOR,
        format!(
            "rounding may put {axis} off by {error:.3} {unit}, more than the noise of the gauges of {rms:.3} {unit} rms"
        ),
        "write scalar = \"f64\", or reduce [workspace]".to_owned(),
    )]
}
