//! The required precision compared with the converters.

use crate::lower::inverse_jacobian;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;

/// Largest accepted `dac.bits`.
const MOST_BITS: u32 = 24;
const AXES: [&str; 3] = ["x", "y", "z"];

/// The finest steps of the converters, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Motion of a leg for one code.
    pub leg: f64,
    /// Motion of the platform along x, y, z for half a code on every leg, with the worst signs.
    pub platform: [f64; 3],
}

/// The steps of the spec's converter. The geometry must not be singular.
pub fn steps(model: &Model) -> Steps {
    let [low, high] = model.dac.range;
    let code = (high - low) / (libm::ldexp(1.0, model.dac.bits as i32) - 1.0);
    let leg = code * model.actuator.leg_gain();
    let inverse = inverse_jacobian(&model.geometry).unwrap_or([[0.0; 6]; 6]);
    let along = |axis: usize| inverse[axis].iter().fold(0.0, |sum, entry| sum + entry.abs()) * leg / 2.0;
    Steps { leg, platform: [along(0), along(1), along(2)] }
}

/// Refuses a converter too coarse for `requirements.precision`.
///
/// # Errors
/// One finding at that key, with the number of bits that would be enough.
pub fn check(model: &Model) -> Result<(), Vec<Diagnostic>> {
    let Some(precision) = model.requirements.precision else { return Ok(()) };
    let steps = steps(model);
    let (mut largest, mut what) = (steps.leg, "one code moves a leg".to_owned());
    for (axis, step) in AXES.iter().zip(steps.platform) {
        if step > largest {
            (largest, what) = (step, format!("half a code on every leg moves the platform along {axis}"));
        }
    }
    if largest <= precision {
        return Ok(());
    }
    // A step is the range over 2^b − 1.
    let codes_needed = (libm::ldexp(1.0, model.dac.bits as i32) - 1.0) * largest / precision;
    let enough = (model.dac.bits..=MOST_BITS).find(|bits| libm::ldexp(1.0, *bits as i32) - 1.0 >= codes_needed);
    let [low, high] = model.dac.range;
    let range = (high - low) * precision / largest;
    let nanometres = |metres: f64| format!("{:.3} nm", metres * 1e9);
    let (step, limit, converter, volts) = (nanometres(largest), nanometres(precision), model.dac.bits, high - low);
    let leg = nanometres(steps.leg);
    Err(vec![Diagnostic::at(
        &model.spans,
        &["requirements.precision"],
        codes::TOO_FEW_BITS,
        format!(
            "{what} by {step}, more than the {limit} of requirements.precision (dac.bits = {converter} over {volts} V, {leg} per code at a leg)"
        ),
        match enough {
            Some(bits) => {
                format!("dac.bits = {bits} is enough; or a `dac.range` of {range:.3} V, or allow {}", up(largest))
            }
            None => format!(
                "no supported converter has enough bits: allow {}, or narrow `dac.range` to {range:.3} V",
                up(largest)
            ),
        },
    )])
}

/// A value for the spec, rounded up to the printed digits.
fn up(metres: f64) -> String {
    format!("\"{:.3} nm\"", (metres * 1e12).ceil() / 1e3)
}
