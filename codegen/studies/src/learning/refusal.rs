//! Why nothing is learned.

use specgen_compiler::compile::Compilation;
use specgen_language::model::TaskSpace;
use specgen_language::outcome::Failure;

/// Why nothing is learned with the model's response.
pub const NOWHERE: &str = "learning converges at no frequency on every machine within the declared intervals; narrow them in [robust] or by \
     --vary, such as stiffness=2%, once they are measured";

/// The `[control]` of a spec whose controller takes a correction.
///
/// # Errors
/// It takes none.
pub fn takes_correction(compiled: &Compilation) -> Result<&TaskSpace, Failure> {
    let task = compiled.model.task_space.as_ref().ok_or_else(|| {
        Failure::Gate(
            "learning is for a spec with [control]: legs with their own gauges learn from tick to tick by EWMA and PCC"
                .to_owned(),
        )
    })?;
    if task.correction.is_none() {
        return Err(Failure::Gate(format!(
            "the controller of this spec takes no correction; write correction = \"<number> um\" in [control], at most {} um",
            1e5 * compiled.model.actuator.stroke
        )));
    }
    Ok(task)
}
