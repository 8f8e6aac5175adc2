//! Reasons learning is refused, and limits of a correction.

use specgen_compiler::compile::Compilation;
use specgen_language::model::{CORRECTION_SHARE, Model, TaskSpace};
use specgen_language::outcome::Failure;

/// Message if learning with the model's response converges nowhere.
pub const NOWHERE: &str = "learning converges at no frequency on every machine within the declared intervals; narrow them in [robust] or with \
     --vary, such as stiffness=2%, if measurements justify it";

/// Factor on a limit that was reached although no value exceeded it.
const LARGER: f64 = 1.1;
/// Relative rounding of values in a spec.
const SAME: f64 = 1.0 + 1e-9;

/// The `[control]` section of a spec whose controller accepts a correction.
///
/// # Errors
/// The controller accepts none.
pub fn takes_correction(compiled: &Compilation) -> Result<&TaskSpace, Failure> {
    let task = compiled.model.task_space.as_ref().ok_or_else(|| {
        Failure::Gate(
            "learning needs a spec with [control]; legs with their own gauges adapt from tick to tick by EWMA and PCC"
                .to_owned(),
        )
    })?;
    if task.correction.is_none() {
        return Err(Failure::Gate(format!(
            "the controller of this spec accepts no correction; write correction = \"<number> um\" in [control], at most {} um",
            1e6 * largest_correction(&compiled.model)
        )));
    }
    Ok(task)
}

/// Largest permitted `control.correction`, m.
pub fn largest_correction(model: &Model) -> f64 {
    CORRECTION_SHARE * model.actuator.stroke
}

/// How to avoid that a correction is limited: from the limit that suffices, that of the spec, and the largest permitted, m.
pub fn larger_limit([sufficient, limit, most]: [f64; 3]) -> String {
    // A correction was limited, so a larger limit is needed, whatever was computed.
    let least = if sufficient > limit { sufficient } else { LARGER * limit };
    if least > most * SAME {
        let (needed, allowed) = (least * 1e6, libm::floor(most * SAME * 1e8) / 1e2);
        return format!(
            "the correction needs {needed:.1} um, but control.correction may be {allowed} um at most: use a smaller or slower motion, or identify the \
             legs again"
        );
    }
    let tenths = libm::ceil(least / SAME * 1e7) / 10.0;
    // Rounding must not exceed the permitted value.
    let most = most * 1e6;
    format!(
        "a limit restricted the correction; in [control] write correction = \"{} um\"",
        if tenths < most { tenths } else { most }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_larger_limit_is_stated_as_the_spec_accepts_it() {
        for ([sufficient, limit, most], expected) in [
            ([2.31e-6, 2e-6, 6e-6], "\"2.4 um\""),
            ([2.4e-6, 2e-6, 6e-6], "\"2.4 um\""),
            // The limit was reached although less was computed.
            ([1.9e-6, 2e-6, 6e-6], "\"2.2 um\""),
            ([5.55e-6, 2e-6, 5.58e-6], "\"5.58 um\""),
            ([7.2e-6, 2e-6, 6e-6], "needs 7.2 um, but control.correction may be 6 um at most"),
        ] {
            let text = larger_limit([sufficient, limit, most]);
            assert!(text.contains(expected), "{text}");
        }
    }
}
