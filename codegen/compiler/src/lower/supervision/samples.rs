//! Faulty samples of the gauges: a jump beyond motion and noise, and more repeated samples than noise explains.

use super::{NOISE_MARGIN, above, finding};
use crate::ir::Sensing;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;
use specgen_runtime::supervisor::WRONG;

/// A second difference of samples has the variance of six.
const SECOND_DIFFERENCE: f64 = 2.449_489_742_783_178;
/// Largest effect of rounding on it, in steps of the converter.
const ROUNDING: f64 = 2.0;
/// Steepest word per metre of a calibrated gauge over the mean of its range.
const STEEPEST: f64 = 1.5;
/// Probability per tick that noise alone causes a fault of repeated samples.
const FALSE_FAULT: f64 = 1e-15;
/// Fewest and most repeated samples that are a fault.
const REPEATS: [u32; 2] = [3, 64];

/// Largest leap of each gauge, in the unit of its words. `readings`: reading of each gauge (rows) per displacement of each leg.
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
        let (leap, effect) = (given * 1e9, noise * 1e9);
        findings.push(finding(
            model,
            codes::SUPERVISOR_BOUND,
            "leap",
            format!(
                "a leap of {leap:.4} nm is less than the effect of the gauge's noise and converter on three samples, {effect:.4} nm"
            ),
            format!(
                "write leap = \"{:.4} nm\" or more, or leave it out: the default is more than a leg can move at actuator.slew_rate",
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

/// Effect of noise and converter on three samples, m.
fn noise(model: &Model) -> f64 {
    NOISE_MARGIN * SECOND_DIFFERENCE * model.sensor.noise + ROUNDING * model.sensor.step()
}

/// Default of `supervisor.leap`, m, for a gauge that measures the displacement of one leg.
pub(crate) fn of_one_leg(model: &Model) -> f64 {
    acceleration(model) + noise(model)
}

/// Largest second difference of a leg's displacement from period to period, m: for a voltage that reverses at the slew rate, behind the
/// lags.
fn acceleration(model: &Model) -> f64 {
    let period = model.timing.period;
    let lag = model.amplifier.lag + model.sensor.lag;
    let part = if lag > period { period / lag } else { 1.0 };
    2.0 * model.actuator.slew_rate * model.actuator.leg_gain() * period * part
}

/// Number of repeated samples that is a fault; 0 if the noise is below a step of the converter, so that repetition means nothing.
pub(super) fn repeats(model: &Model) -> u32 {
    let noise = model.sensor.noise / model.sensor.step();
    if noise <= 1.0 {
        return 0;
    }
    let repeated = repeated(noise);
    let (mut count, mut probability) = (1, repeated);
    // Each further repetition comes before the count has decayed.
    while count < REPEATS[1] && (probability > FALSE_FAULT || count < REPEATS[0]) {
        probability *= repeated * f64::from(WRONG * count - 1);
        count += 1;
    }
    WRONG * count
}

/// Probability that six codes equal those of one of the two samples before, for noise (rms) of so many steps.
fn repeated(noise: f64) -> f64 {
    let spread = core::f64::consts::SQRT_2 * noise;
    let within = libm::erf(1.0 / (spread * core::f64::consts::SQRT_2));
    let edges = 2.0 * spread / libm::sqrt(core::f64::consts::TAU) * -libm::expm1(-0.5 / (spread * spread));
    2.0 * libm::pow(within - edges, 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with counted codes, for noise of 1 and 2.6 steps.
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
