//! Voltage limits and slew rate as converter codes, and the codes on the Everett grid.

use crate::diagnostic::{Diagnostic, Place, Severity, codes};
use crate::ir::{Actuation, Scalar};
use crate::model::Model;

/// Returns the converter constants and the slew limit in codes per tick.
pub(super) fn lower(model: &Model, scalar: Scalar) -> Result<(Actuation, i32), Vec<Diagnostic>> {
    let [volts_at_zero, volts_full] = model.dac.range;
    let [volts_min, volts_max] = model.actuator.voltage;
    let full_scale = (1_i32 << model.dac.bits) - 1;
    let volts_per_code = (volts_full - volts_at_zero) / f64::from(full_scale);
    let cell = (volts_max - volts_min) / model.hysteresis.grid as f64;
    // The limits hold for the voltage as the controller computes it, in its own arithmetic.
    let voltage = |code: i32| {
        scalar.round(scalar.round(volts_at_zero) + scalar.round(f64::from(code) * scalar.round(volts_per_code)))
    };
    let mut code_min = (((volts_min - volts_at_zero) / volts_per_code).round() as i32).clamp(0, full_scale);
    while code_min < full_scale && voltage(code_min) < volts_min {
        code_min += 1;
    }
    let mut code_max = (((volts_max - volts_at_zero) / volts_per_code).round() as i32).clamp(0, full_scale);
    while code_max > 0 && voltage(code_max) > volts_max {
        code_max -= 1;
    }
    let mut findings = Vec::new();
    if code_max - code_min < 2 * model.hysteresis.grid as i32 {
        findings.push(finding(
            model,
            codes::TOO_FEW_CODES,
            "dac.bits",
            format!(
                "the converter has only {} codes between {volts_min} V and {volts_max} V, fewer than two per cell of the {}-cell Preisach grid",
                code_max - code_min + 1,
                model.hysteresis.grid
            ),
            "use a converter with more bits or a narrower range".to_owned(),
        ));
    }
    // The spec was checked to allow one code per tick; rounding must not take it away.
    let step = (model.actuator.slew_rate * model.timing.period / volts_per_code).max(1.0);
    if !findings.is_empty() {
        return Err(findings);
    }
    let max_step = if step >= f64::from(full_scale) { full_scale } else { step as i32 };
    let actuation = Actuation {
        bits: model.dac.bits,
        volts_at_zero: scalar.round(volts_at_zero),
        volts_per_code: scalar.round(volts_per_code),
        cells_at_zero: scalar.round((volts_at_zero - volts_min) / cell),
        cells_per_code: scalar.round(volts_per_code / cell),
        codes_per_cell: scalar.round(cell / volts_per_code),
        code_min,
        code_max,
        voltage: [volts_min, volts_max],
    };
    Ok((actuation, max_step))
}

fn finding(model: &Model, code: &'static str, key: &str, message: String, help: String) -> Diagnostic {
    let place = model.spans.get(key).cloned().map_or(Place::Whole, Place::Spec);
    Diagnostic { severity: Severity::Error, code, key: key.to_owned(), place, message, help }
}
