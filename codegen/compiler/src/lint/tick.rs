//! Whether the board that a spec names can keep its period, by a table of what boards and laws take. `specgen build` estimates
//! the tick from the image itself, a minute later, and refuses a period that is shorter.

use super::{Facts, Found, Lints, figure};
use specgen_language::diagnostic::codes;
use specgen_language::model::{DynamicsChoice, Interaction, Mcu, Model, Scalar};

pub(super) static LINTS: Lints = Lints { rules: &[fits_period], codes: &[] };

/// Longest tick of a board, µs: of six legs as in `specs/legs.toml`, of a platform as in `specs/reference.toml`, and of one with
/// the whole kernel of the inverse dynamics. Of the H743 as `specgen build` estimates it; of six legs and of the whole kernel
/// in `f32` it is scaled from the others. Of the F446 the platform alone is known, from 49 to 98 (docs/bring-up.md): six legs
/// stand at the least of it and the whole kernel at the most, so that nothing is refused that would fit.
const TICKS: [(Mcu, Scalar, [f64; 3]); 3] = [
    (Mcu::Stm32H743Zi, Scalar::F64, [40.0, 49.0, 58.0]),
    (Mcu::Stm32H743Zi, Scalar::F32, [35.0, 39.0, 43.0]),
    (Mcu::Stm32F446Re, Scalar::F32, [49.0, 98.0, 98.0]),
];
/// Another law, scalar or compiler takes this share of the table at least: below it the period is refused.
const CERTAIN: f64 = 0.8;

/// About what the longest tick of the named board takes, s; none for an emulated one.
#[must_use]
pub fn about(model: &Model) -> Option<f64> {
    let is_of = |mcu: Mcu, scalar: Scalar| mcu == model.target.mcu && scalar == model.controller.scalar;
    let (.., [legs, platform, whole]) = TICKS.into_iter().find(|(mcu, scalar, _)| is_of(*mcu, *scalar))?;
    let time = match &model.task_space {
        None => legs,
        Some(task) if task.dynamics == DynamicsChoice::Whole || task.interaction != Interaction::None => whole,
        Some(_) => platform,
    };
    Some(time * 1e-6)
}

/// The period is longer than what the tick of the named board takes.
fn fits_period(facts: &Facts, found: &mut Found) {
    let (model, period) = (facts.model, facts.model.timing.period);
    let Some(tick) = about(model).filter(|tick| period < *tick) else { return };
    let part = model.target.mcu.part();
    let (code, verdict) = if period < CERTAIN * tick {
        (codes::TICK_TOO_LONG, "more than")
    } else {
        (codes::TICK_TIGHT, "about as long as")
    };
    found.add(
        code,
        "timing.period",
        format!(
            "a tick of such a controller takes about {} us on {}, {verdict} the period of {} us",
            figure(tick * 1e6),
            part.board,
            figure(period * 1e6)
        ),
        &format!(
            "write, in [timing]: period = \"{} us\" or more, or name a faster part in `target.mcu`; `specgen build` estimates the tick from the image",
            figure(1.25 * tick * 1e6)
        ),
    );
}
