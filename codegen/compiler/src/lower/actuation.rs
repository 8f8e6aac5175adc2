//! Voltage limits and slew rate as converter codes, and the codes on the Everett grid.

use crate::ir::{Actuation, Scalar};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;

/// Returns the converter constants and the slew limit in codes per tick.
pub(super) fn lower(model: &Model, scalar: Scalar) -> Result<(Actuation, i32), Vec<Diagnostic>> {
    let [volts_at_zero, volts_full] = model.dac.range;
    let [volts_min, volts_max] = model.actuator.voltage;
    let full_scale = (1_i32 << model.dac.bits) - 1;
    let volts_per_code = (volts_full - volts_at_zero) / f64::from(full_scale);
    let cell = (volts_max - volts_min) / model.hysteresis.grid as f64;
    // The limits apply to the voltage as the controller computes it, in its own arithmetic.
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
        let (codes, grid) = (code_max - code_min + 1, &model.hysteresis.grid);
        findings.push(Diagnostic::at(&model.spans, &["dac.bits"], codes::TOO_FEW_CODES,
            format!(
                "the converter has only {codes} codes between {volts_min} V and {volts_max} V, fewer than two per cell of the {grid}-cell Preisach grid"
            ),
            "use a converter with more bits or a narrower range".to_owned(),
        ));
    }
    // The spec is checked to allow one code per tick; rounding must not reduce that to zero.
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use specgen_runtime::{Dac, Real};

    use super::*;
    use specgen_language::spec::{self, SpecSource};

    /// Codes whose voltage, as the controller computes it, is within `volts`; checks every code.
    fn within<T: Real + Into<f64>>(actuation: &Actuation, volts: [f64; 2]) -> [i32; 2] {
        let [volts_at_zero, volts_per_code, cells_at_zero, cells_per_code, codes_per_cell] = [
            actuation.volts_at_zero,
            actuation.volts_per_code,
            actuation.cells_at_zero,
            actuation.cells_per_code,
            actuation.codes_per_cell,
        ]
        .map(T::from_f64);
        let dac = Dac { volts_at_zero, volts_per_code, cells_at_zero, cells_per_code, codes_per_cell };
        let inside = |code: &i32| (volts[0]..=volts[1]).contains(&dac.voltage(*code).into());
        let all: Vec<i32> = (0..1 << actuation.bits).filter(inside).collect();
        let (first, last) = (all[0], all[all.len() - 1]);
        assert_eq!(all.len() as i32, last - first + 1, "codes inside the range are consecutive");
        [first, last]
    }

    /// Together with `firmware/runtime/tests/all/dac_exact.rs` (no code exceeds the limits or changes by more than the step for any
    /// input): no voltage exceeds `actuator.voltage` or changes faster than `actuator.slew_rate`.
    #[test]
    fn the_codes_within_the_limits_are_those_of_voltages_within_the_limits_and_the_step_is_no_faster_than_the_slew_rate()
     {
        let specs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs");
        let source = SpecSource::read(&specs.join("reference.toml")).unwrap();
        let mut model = spec::load(&source).0.unwrap();
        let mut tried = 0;
        for bits in [12, 13, 15, 16, 18, 20, 24] {
            for range in [[0.0, 150.0], [-30.0, 150.0], [-0.1, 100.1], [-1e3 / 3.0, 1e3]] {
                for volts in [[0.0, 100.0], [-20.0, 130.0], [-0.1, 99.999_999], range, [100.0 / 3.0, 70.1]] {
                    let [low, high] = volts;
                    if low < range[0] || high > range[1] {
                        continue;
                    }
                    model.dac.bits = bits;
                    (model.dac.range, model.actuator.voltage) = (range, volts);
                    for scalar in [Scalar::F32, Scalar::F64] {
                        let (actuation, max_step) = lower(&model, scalar).unwrap();
                        let inside = match scalar {
                            Scalar::F32 => within::<f32>(&actuation, volts),
                            Scalar::F64 => within::<f64>(&actuation, volts),
                        };
                        assert_eq!(
                            [actuation.code_min, actuation.code_max],
                            inside,
                            "{bits} {range:?} {volts:?} {scalar:?}"
                        );
                        let code = (range[1] - range[0]) / f64::from((1 << bits) - 1);
                        let fastest = f64::from(max_step) * code / model.timing.period;
                        assert!(
                            max_step >= 1 && (max_step == 1 || fastest <= model.actuator.slew_rate * (1.0 + 1e-15))
                        );
                        tried += 1;
                    }
                }
            }
        }
        assert!(tried > 100, "{tried}");
    }
}
