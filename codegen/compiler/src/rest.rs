//! Noise of the pose at rest, compared with the requirements of the spec.

use serde::Serialize;

use crate::lower::{self, inverse_jacobian};
use crate::stability::platform::{Design, RestDynamics};
use crate::stability::{LegDynamics, shown_at_rest};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{AdaptationMode, Model};
use specgen_numerics::Matrix6;

const AXES: [&str; 6] = ["x", "y", "z", "theta_x", "theta_y", "theta_z"];

/// Noise of the pose at rest, rms, as the gauges measure it while the controller holds it: x, y, z in m, θx, θy, θz in rad.
///
/// For six legs with their own gauges, it is the noise of the pose computed from their readings. The steps of the drive's converter
/// are not included: `requirements.precision` has its own check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestNoise {
    /// Gauges and amplifiers together. They are independent: the root of the sum of the squares.
    pub pose: [f64; 6],
    /// Due to the noise of the gauges and the steps of their converters.
    pub gauges: [f64; 6],
    /// Due to the noise of the amplifiers, with the gain of a leg over its whole range. This is an upper bound: the gain for some
    /// millivolts is lower. The simulated machine has 0.58 of it.
    pub amplifiers: [f64; 6],
    /// Noise of one reading, steps of the converter included, m.
    pub reading: f64,
}

/// Computes it: with `design`, the closed loop of the platform in the spec's mode; without, each leg on its own.
///
/// # Errors
/// Gauges or legs that do not determine the pose.
pub fn noise(model: &Model, design: Option<&Design>) -> Result<RestNoise, Vec<Diagnostic>> {
    let [reading, _] = lower::reading_noise(model);
    let asked = model.actuator.leg_gain() * model.amplifier.noise;
    let per_leg = inverse_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let [gauges, amplifiers] = match (&model.task_space, design) {
        (Some(task), Some(design)) => {
            let plant = RestDynamics::of(&lower::platform(model)?);
            let per_reading = lower::poses_per_reading(model)?.unwrap_or([[0.0; 6]; 6]);
            let (law, tuning) = design.law(model, task);
            let closed_loop = design.closed_loop(model, task, &plant);
            closed_loop.map_or([[0.0; 6]; 2], |closed_loop| {
                closed_loop.at_rest(law, tuning, &scaled(&per_reading, reading), &scaled(&per_leg, asked))
            })
        }
        _ => {
            let shown = shown_at_rest(&LegDynamics::of(model), weights(model), model.timing.period);
            [(reading, shown[0]), (asked, shown[1])].map(|(noise, variance)| {
                per_leg.map(|row| variance * noise * noise * row.iter().fold(0.0, |sum, x| sum + x * x))
            })
        }
    };
    let root = |variances: [f64; 6]| variances.map(libm::sqrt);
    let pose = root(core::array::from_fn(|axis| gauges[axis] + amplifiers[axis]));
    Ok(RestNoise { pose, gauges: root(gauges), amplifiers: root(amplifiers), reading })
}

/// Weights of level and drift that a leg with its own gauge uses.
fn weights(model: &Model) -> Option<(f64, Option<f64>)> {
    let adaptation = &model.adaptation;
    match adaptation.mode {
        AdaptationMode::Invhys => None,
        AdaptationMode::Ewma => Some((adaptation.level_weight, None)),
        AdaptationMode::Pcc => Some((adaptation.level_weight, Some(adaptation.drift_weight))),
    }
}

fn scaled(matrix: &Matrix6, factor: f64) -> Matrix6 {
    matrix.map(|row| row.map(|x| x * factor))
}

/// Findings beyond the spec's limits: the worst of x, y, z, and the worst rotation. They are errors for `check`, `build` and
/// boards; a simulation still runs.
pub fn check(model: &Model, noise: &RestNoise) -> Vec<Diagnostic> {
    let beyond = |axis: usize| model.requirements.noise_of(axis).map_or(0.0, |(limit, _)| noise.pose[axis] / limit);
    let worst = |axes: core::ops::Range<usize>| axes.reduce(|a, b| if beyond(b) > beyond(a) { b } else { a });
    let found = [worst(0..3), worst(3..6)].into_iter().flatten().filter(|axis| beyond(*axis) > 1.0);
    found.filter_map(|axis| finding(model, noise, axis)).collect()
}

fn finding(model: &Model, noise: &RestNoise, axis: usize) -> Option<Diagnostic> {
    let (limit, key) = model.requirements.noise_of(axis)?;
    let unit = if axis < 3 { "nm" } else { "nrad" };
    let shown = |value: f64| format!("{:.3} {unit}", value * 1e9);
    let (gauges, amplifiers) = (noise.gauges[axis], noise.amplifiers[axis]);
    let (rms, name, most, of_gauges) = (shown(noise.pose[axis]), AXES[axis], shown(limit), shown(gauges));
    let (reading, of_amplifiers) = (noise.reading * 1e9, shown(amplifiers));
    let message = format!(
        "the pose at rest has a noise of {rms} rms in {name}, more than the {most} of {key}: {of_gauges} from the gauges ({reading:.3} nm per reading, with the steps of \
         their converter), {of_amplifiers} from the amplifiers"
    );
    let (what, source) = if gauges > amplifiers {
        ("the gauges", "`sensor.noise`, `sensor.bits`")
    } else {
        ("the amplifiers", "`amplifier.noise`")
    };
    let allowing = if axis < 3 { "noise" } else { "rotation_noise" };
    // Rounded up to the printed digits; among axes with the same limit this one is the noisiest.
    let largest = libm::ceil(noise.pose[axis] * 1e12) / 1e3;
    let help = format!(
        "most of it comes from {what}: correct {source} or use better ones; or allow it, in [requirements]: {allowing} = \"{largest:.3} {unit}\""
    );
    Some(Diagnostic::at(&model.spans, &[key], codes::NOISE_AT_REST, message, help))
}
