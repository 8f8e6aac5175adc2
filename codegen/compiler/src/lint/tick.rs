//! Whether the board in the spec can keep the period, by the typical tick times in the manifests of the boards. `specgen build`
//! estimates the tick from the image and refuses a shorter period.

use super::{Facts, Findings, Lints, figure};
use specgen_language::diagnostic::codes;
use specgen_language::model::{DynamicsChoice, Interaction, Mcu, Model, Scalar};

pub(super) static LINTS: Lints = Lints { rules: &[fits_period], codes: &[] };

/// Share of the typical time below which the period is refused: no law, scalar or compiler is faster than that.
const CERTAIN: f64 = 0.8;

/// Typical time of the longest tick on the named board, s; none for an emulated one.
pub fn about(model: &Model) -> Option<f64> {
    let Mcu::Board(board) = model.target.mcu else { return None };
    let ticks = match model.controller.scalar {
        Scalar::F32 => board.ticks_f32,
        Scalar::F64 => board.ticks_f64,
    };
    let [legs, platform, whole] = *ticks else { return None };
    let time = match &model.task_space {
        None => legs,
        Some(task) if task.dynamics == DynamicsChoice::Whole || task.interaction != Interaction::None => whole,
        Some(_) => platform,
    };
    Some(f64::from(time) * 1e-6)
}

/// Checks the period against the typical tick time of the named board.
fn fits_period(facts: &Facts, found: &mut Findings) {
    let (model, period) = (facts.model, facts.model.timing.period);
    let Some(tick) = about(model).filter(|tick| period < *tick) else { return };
    let part = model.target.mcu.part();
    let (code, verdict) = if period < CERTAIN * tick {
        (codes::TICK_TOO_LONG, "more than")
    } else {
        (codes::TICK_TIGHT, "about as long as")
    };
    let (taken, board, period) = (figure(tick * 1e6), &part.board, figure(period * 1e6));
    found.add(
        code,
        "timing.period",
        format!(
            "a tick of such a controller takes about {taken} us on {board}, {verdict} the period of {period} us"
        ),
        &format!(
            "write, in [timing]: period = \"{} us\" or more, or name a faster part in `target.mcu`; `specgen build` estimates the tick from the image",
            figure(1.25 * tick * 1e6)
        ),
    );
}
