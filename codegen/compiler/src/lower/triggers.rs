//! Lowers triggers: default values, and times in ticks.

use crate::ir::{Line, Scalar};
use specgen_language::model::{Model, TaskSpace, Trigger, TriggerDirection, TriggerKind};
use specgen_runtime::trigger::{Direction, Kind, LONGEST, MOST_STEPS};

/// Default hysteresis, in rms noise of the pose.
pub const QUIET: f64 = 10.0;

/// Largest position and smallest step that any line may have: m and rad.
#[must_use]
pub fn extent(bounds: &[f64; 6]) -> [f64; 2] {
    let most = bounds.iter().fold(0.0, |most: f64, bound| if *bound > most { *bound } else { most });
    [most, 2.0 * most / f64::from(MOST_STEPS)]
}

/// Distance from a position at which it is armed again, m or rad: from the spec, or by the `noise` of each axis.
#[must_use]
pub fn hysteresis(trigger: &Trigger, noise: &[f64; 6]) -> f64 {
    trigger.hysteresis.unwrap_or(QUIET * noise[trigger.axis])
}

/// Length of a pulse, ticks.
#[must_use]
pub fn width(trigger: &Trigger, period: f64) -> i32 {
    let ticks = libm::rint(trigger.width.unwrap_or(period) / period);
    (if ticks < 1.0 { 1.0 } else { ticks } as i32).min(LONGEST)
}

/// The output lines of a spec, whose pose has `noise` on each axis, m and rad.
pub(super) fn lower(model: &Model, task: &TaskSpace, noise: &[f64; 6], scalar: Scalar) -> Vec<Line> {
    let bounds = model.workspace.bounds();
    let [most, _] = extent(&bounds);
    let line = |trigger: &Trigger| {
        let kind = kind(trigger.kind)?;
        let places = matches!(trigger.kind, TriggerKind::Position | TriggerKind::Level);
        let of_place = |value: f64| if places { scalar.round(value) } else { 0.0 };
        Some(Line {
            kind,
            axis: trigger.axis,
            direction: match trigger.direction {
                TriggerDirection::Both => Direction::Both,
                TriggerDirection::Up => Direction::Up,
                TriggerDirection::Down => Direction::Down,
            },
            start: of_place(trigger.start.unwrap_or(0.0)),
            stop: of_place(trigger.stop.unwrap_or(bounds[trigger.axis])),
            step: scalar.round(trigger.step.unwrap_or(most)),
            hysteresis: of_place(hysteresis(trigger, noise)),
            first: trigger.first,
            every: trigger.every,
            last: trigger.last.unwrap_or(0),
            width: width(trigger, model.timing.period),
        })
    };
    task.triggers.iter().filter_map(line).collect()
}

/// Kind of an output line; none for an input.
fn kind(kind: TriggerKind) -> Option<Kind> {
    Some(match kind {
        TriggerKind::Position => Kind::Position,
        TriggerKind::Level => Kind::Level,
        TriggerKind::Motion => Kind::Motion,
        TriggerKind::Points => Kind::Points,
        TriggerKind::Ticks => Kind::Ticks,
        TriggerKind::Input => return None,
    })
}
