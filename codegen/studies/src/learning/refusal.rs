//! Reasons learning is refused.

use specgen_compiler::compile::Compilation;
use specgen_language::model::TaskSpace;
use specgen_language::outcome::Failure;

/// Message if learning with the model's response converges nowhere.
pub const NOWHERE: &str = "learning converges at no frequency on every machine within the declared intervals; narrow them in [robust] or with \
     --vary, such as stiffness=2%, if measurements justify it";

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
            1e5 * compiled.model.actuator.stroke
        )));
    }
    Ok(task)
}
