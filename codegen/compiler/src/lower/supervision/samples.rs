//! What makes a sample of the gauges wrong: the leap that no leg and no noise can make, and how many repeated samples noise does not make.

use super::{NOISE_MARGIN, above, finding};
use crate::ir::Sensing;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;
use specgen_runtime::supervisor::WRONG;

/// A second difference of samples has the variance of six.
const SECOND_DIFFERENCE: f64 = 2.449_489_742_783_178;
/// Steps of the converter that rounding makes of it, at most.
const ROUNDING: f64 = 2.0;
/// Of a calibrated gauge, its steepest word per metre over that of its range.
const STEEPEST: f64 = 1.5;
/// Probability a tick with which noise alone may make a fault of repeated samples.
const FALSE_FAULT: f64 = 1e-15;
/// Fewest repeated samples that are a fault, and most.
const REPEATS: [u32; 2] = [3, 64];

/// Largest leap of each gauge, in the unit of its words. `readings`: of each gauge (rows) per displacement of each leg.
pub(super) fn leap(
    model: &Model,
    readings: &[[f64; 6]; 6],
    sensing: Option<&Sensing>,
    findings: &mut Vec<Diagnostic>,
) -> [f64; 6] {
    let [low, high] = model.sensor.range;
    let noise = noise(model);
    let motion = readings.map(|row| row.iter().map(|part| part.abs()).sum::<f64>() * acceleration(model));
    if let Some(given) = model.supervisor.leap
        && given < noise
    {
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "leap",
            format!(
                "a leap of {:.4} nm is below what the gauge's noise and converter make of three samples, {:.4} nm",
                given * 1e9,
                noise * 1e9
            ),
            format!(
                "write leap = \"{:.4} nm\" or more; without the key no leg can leap so far at actuator.slew_rate",
                above(noise * 1e9)
            ),
        ));
    }
    core::array::from_fn(|gauge| {
        let scale = match sensing {
            Some(Sensing { calibration: Some(_), raw_limits, .. }) => {
                let [first, last] = raw_limits[gauge];
                STEEPEST * (last - first).abs() / (high - low)
            }
            _ => 1.0,
        };
        scale * model.supervisor.leap.unwrap_or(motion[gauge] + noise)
    })
}

/// What noise and converter make of three samples, m.
fn noise(model: &Model) -> f64 {
    NOISE_MARGIN * SECOND_DIFFERENCE * model.sensor.noise + ROUNDING * model.sensor.step()
}

/// Without `supervisor.leap`, m, of a gauge that shows the displacement of one leg.
pub(crate) fn of_one_leg(model: &Model) -> f64 {
    acceleration(model) + noise(model)
}

/// By how much the displacement of a leg may change its motion from one period to the next, m: as much as voltages that turn round at the
/// slew rate make of it behind the lags.
fn acceleration(model: &Model) -> f64 {
    let period = model.timing.period;
    let lag = model.amplifier.lag + model.sensor.lag;
    let part = if lag > period { period / lag } else { 1.0 };
    2.0 * model.actuator.slew_rate * model.actuator.leg_gain() * period * part
}

/// Count at which repeated samples are a fault; 0 where the noise is not above a step of the converter, so that they say nothing.
pub(super) fn repeats(model: &Model) -> u32 {
    let noise = model.sensor.noise / model.sensor.step();
    if noise <= 1.0 {
        return 0;
    }
    let repeated = repeated(noise);
    let (mut count, mut probability) = (1, repeated);
    // Each further one comes before the count has fallen to nothing.
    while count < REPEATS[1] && (probability > FALSE_FAULT || count < REPEATS[0]) {
        probability *= repeated * f64::from(WRONG * count - 1);
        count += 1;
    }
    WRONG * count
}

/// Probability that six codes are those of one of the two samples before, by noise (rms) of so many steps.
fn repeated(noise: f64) -> f64 {
    let spread = core::f64::consts::SQRT_2 * noise;
    let within = libm::erf(1.0 / (spread * core::f64::consts::SQRT_2));
    let edges = 2.0 * spread / libm::sqrt(core::f64::consts::TAU) * -libm::expm1(-0.5 / (spread * spread));
    2.0 * libm::pow(within - edges, 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against codes that are counted, for noise of 1 and 2.6 steps.
    #[test]
    fn the_probability_of_a_repeated_code_is_that_of_the_sum_over_codes() {
        for noise in [1.0, 2.6] {
            let (mut sum, phases) = (0.0, 1000);
            for phase in 0..phases {
                let offset = f64::from(phase) / f64::from(phases);
                let below =
                    |code: i32| 0.5 * libm::erfc(-(f64::from(code) + offset) / (noise * core::f64::consts::SQRT_2));
                sum += (-60..60).map(|code| libm::pow(below(code + 1) - below(code), 2.0)).sum::<f64>()
                    / f64::from(phases);
            }
            let expected = 2.0 * libm::pow(sum, 6.0);
            assert!((repeated(noise) / expected - 1.0).abs() < 1e-6, "{} {expected}", repeated(noise));
        }
    }
}
