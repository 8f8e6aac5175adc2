//! Requirements that would be met whatever is built.

use super::{Facts, Found, figure};
use specgen_language::diagnostic::codes;

/// A precision or an error of more than this share of the stroke asks nothing of a nanopositioner.
const LOOSEST: f64 = 0.05;

/// What the platform is for is finer than a twentieth of its stroke.
pub(super) fn ask_something(facts: &Facts, found: &mut Found) {
    let (model, stroke) = (facts.model, facts.model.actuator.stroke);
    for (key, limit) in [
        ("requirements.precision", model.requirements.precision),
        ("robust.max_error", model.robust.max_error),
        ("robust.max_learned", model.robust.max_learned),
    ] {
        let Some(limit) = limit.filter(|limit| *limit > LOOSEST * stroke) else { continue };
        found.add(
            codes::ASKS_NOTHING,
            key,
            format!("`{key}` is {} um, of a stroke of {} um", figure(limit * 1e6), figure(stroke * 1e6)),
            "whatever is built meets that: check the unit, nm or um",
        );
    }
}
