//! Detection of sustained oscillation: the error that noise, environment and motion explain, and the least duration.

use super::{CHANNELS, above, defaults, finding, whole};
use crate::ir::Scalar;
use crate::lower::sensing::{PoseNoise, pose_noise};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;
use specgen_runtime::supervisor::Steadiness;

/// Lowest frequency of the detection, Hz: below it the feedback acts.
pub(crate) const LOWEST: f64 = 60.0;
/// Least oscillation, in rms noise of an axis.
const NOISE_MARGIN: f64 = 6.0;
/// Amplitude of the error that the set-point explains, as a share of its amplitude.
const MOTION: f64 = 1.0;
/// Time constant with which the explained error decays, in decay times of the slowest mode: more for the whole error, because machines
/// differ from the model and close modes beat, less in a stage. And the least time constant, s.
const HELD: [f64; 2] = [8.0, 3.0];
const SHORTEST_HELD: f64 = 0.06;
/// Time to the first stage, and from one stage to the next, s.
const FIRST: f64 = 0.03;
const NEXT: f64 = 0.1;
/// Longest half period of an oscillation, s: that of 45 Hz.
const ONE_WAY: f64 = 0.011;
const FEWEST_ONE_WAY: f64 = 3.0;
/// Fewest samples.
const FEWEST: f64 = 12.0;

/// Lever arms of angles at the platform joints, m/rad, and the least amplitude (m) above the noise of every axis.
fn arms_and_least(model: &Model, noise: Option<&PoseNoise>) -> ([f64; 6], f64) {
    let (arms, noise) = match noise {
        Some(noise) => {
            let radius = model.geometry.joint_radius();
            ([1.0, 1.0, 1.0, radius, radius, radius], noise.pose)
        }
        None => ([1.0; 6], [model.sensor.noise; 6]),
    };
    let least = arms.iter().zip(noise).map(|(arm, noise)| NOISE_MARGIN * noise * arm).fold(0.0, libm::fmax);
    (arms, least)
}

/// Default of `supervisor.disturbance`, m.
pub(crate) fn usual(model: &Model) -> f64 {
    let noise = pose_noise(model).ok().flatten();
    libm::fmax(defaults::disturbance(model), arms_and_least(model, noise.as_ref()).1)
}

pub(super) fn lower(
    model: &Model,
    noise: Option<&PoseNoise>,
    rings: f64,
    scalar: Scalar,
    findings: &mut Vec<Diagnostic>,
) -> Steadiness<f64> {
    let between = CHANNELS * model.timing.period;
    let (arms, least) = arms_and_least(model, noise);
    let disturbance = model.supervisor.disturbance.unwrap_or(libm::fmax(defaults::disturbance(model), least));
    if disturbance < least {
        let (given, effect) = (disturbance * 1e9, least * 1e9);
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "disturbance",
            format!(
                "a disturbance of {given:.4} nm is less than the effect of the gauges' noise on one axis, {effect:.4} nm"
            ),
            format!("write disturbance = \"{:.4} nm\" or more", above(least * 1e9)),
        ));
    }
    let follow = 1.0 - libm::exp(-core::f64::consts::TAU * LOWEST * between);
    let [keep, keep_fallen] = HELD.map(|times| {
        let held = times * rings;
        let held = if held > SHORTEST_HELD { held } else { SHORTEST_HELD };
        libm::exp(-2.0 * model.timing.period / held)
    });
    let samples = |time: f64, fewest: f64| {
        let samples = libm::round(time / between);
        whole(if samples > fewest { samples } else { fewest })
    };
    let round = |value: f64| scalar.round(value);
    Steadiness {
        per_limit: arms.map(|arm| round(arm / disturbance)),
        follow: round(follow),
        motion: round(MOTION / follow),
        keep: round(keep),
        keep_fallen: round(keep_fallen),
        one_way: samples(ONE_WAY, FEWEST_ONE_WAY),
        first: samples(FIRST, FEWEST),
        next: samples(NEXT, FEWEST),
    }
}
