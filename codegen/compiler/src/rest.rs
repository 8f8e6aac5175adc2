//! Noise of the pose at rest, against what the spec asks for.

use serde::Serialize;

use crate::lower::{self, inverse_jacobian};
use crate::stability::platform::{Design, RestDynamics};
use crate::stability::{LegDynamics, shown_at_rest};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{AdaptationMode, Model};
use specgen_numerics::Matrix6;

const AXES: [&str; 6] = ["x", "y", "z", "theta_x", "theta_y", "theta_z"];

/// Noise of the pose at rest, rms, as the gauges show it while the controller holds it: x, y, z in m, θx, θy, θz in rad.
///
/// Of six legs with their own gauges, which do not see the platform, it is what their readings give the pose. The steps of the drive's
/// converter are left out: `requirements.precision` has a check of its own for them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestNoise {
    /// Gauges and amplifiers together, which are independent: the root of the sum of the squares.
    pub pose: [f64; 6],
    /// By the noise of the gauges and the steps of their converters.
    pub gauges: [f64; 6],
    /// By the noise of the amplifiers, with the gain of a leg over its whole range: a bound, for a voltage of some millivolts switches little
    /// of the hysteresis and moves a leg by less. 0.58 of it was found on the simulated machine.
    pub amplifiers: [f64; 6],
    /// Of one reading, steps of the converter included, m.
    pub reading: f64,
}

/// Computes it: with `design`, the closed loop of the platform in the spec's mode; without, each leg on its own.
///
/// # Errors
/// Gauges that do not fix the pose, or legs that do not hold the platform.
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

/// Weights of level and drift that are in use on a leg of its own.
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

/// What is beyond the spec's limits: the worst of x, y, z, and of the rotations. The errors refuse no simulation; what judges a spec shows
/// them, and a board takes no such controller.
#[must_use]
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
    let message = format!(
        "the pose at rest has a noise of {} rms in {}, more than the {} of {key}: {} by the gauges ({:.3} nm a reading, with the steps of \
         their converter), {} by the amplifiers",
        shown(noise.pose[axis]),
        AXES[axis],
        shown(limit),
        shown(gauges),
        noise.reading * 1e9,
        shown(amplifiers)
    );
    let (what, source) = if gauges > amplifiers {
        ("the gauges", "`sensor.noise`, `sensor.bits`")
    } else {
        ("the amplifiers", "`amplifier.noise`")
    };
    let allowing = if axis < 3 { "noise" } else { "rotation_noise" };
    // Rounded up to what is printed; of axes with the same limit this one is the noisiest.
    let largest = libm::ceil(noise.pose[axis] * 1e12) / 1e3;
    let help = format!(
        "it is made by {what} above all: correct {source} or take better ones; or allow it, in [requirements]: {allowing} = \"{largest:.3} {unit}\""
    );
    Some(Diagnostic::at(&model.spans, &[key], codes::NOISE_AT_REST, message, help))
}
