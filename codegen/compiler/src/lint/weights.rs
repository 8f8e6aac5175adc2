//! How fast the run-to-run adaptation works, and for which gains.

use super::{Facts, Found, figure};
use specgen_language::diagnostic::codes;
use specgen_language::model::AdaptationMode;

/// λ = ρ/ρ̂ that a stack may have. At small signals ceramics move half as far per volt as over their range, in the cold of
/// liquid nitrogen a quarter.
const SOUND_RATIO: core::ops::RangeInclusive<f64> = 0.2..=4.0;
/// Slowest adaptation, rad/s: half a second to take out what a hysteresis model leaves, which changes with every turn.
const SLOWEST: f64 = 2.0;
/// Drift estimate over level estimate: slower, but not so slow that the level has long followed.
const SOUND_DRIFT: core::ops::RangeInclusive<f64> = 5e-4..=1.0;

/// Gains of stacks stay within a few times of what was identified.
pub(super) fn ratio_of_gains(facts: &Facts, found: &mut Found) {
    for (end, ratio) in facts.model.adaptation.gain_ratio.into_iter().enumerate() {
        if SOUND_RATIO.contains(&ratio) {
            continue;
        }
        found.add(
            codes::GAIN_RATIO_ODD,
            &format!("adaptation.gain_ratio[{end}]"),
            format!("the loop is to be stable for stacks whose gain is {} times what was identified", figure(ratio)),
            "a stack's gain at small signals is about half of that over its range, in the cold a quarter: 0.5 to 1.5 is a wide interval",
        );
    }
}

/// Bandwidths of level and drift in use, rad/s, with their keys.
fn bandwidths(facts: &Facts) -> Option<[(String, f64); 2]> {
    let model = facts.model;
    let run = model.timing.period * f64::from(model.adaptation.run_interval);
    let values = match &model.task_space {
        Some(task) => task.adaptation?,
        None => [model.adaptation.level_weight / run, model.adaptation.drift_weight / run],
    };
    let mut which = ["level", "drift"].into_iter();
    Some(values.map(|value| {
        let name = which.next().unwrap_or("level");
        let bandwidth = format!("adaptation.{name}_bandwidth");
        let given = model.spans.contains_key(&bandwidth);
        (if given { bandwidth } else { format!("adaptation.{name}_weight") }, value)
    }))
}

/// An adaptation that is still at it when the error is another one.
pub(super) fn adapts_in_time(facts: &Facts, found: &mut Found) {
    let Some([(key, level), _]) = bandwidths(facts) else { return };
    if level == 0.0 || level >= SLOWEST {
        return;
    }
    found.add(
        codes::ADAPTATION_SLOW,
        &key,
        format!("the level estimate follows at {} rad/s: it takes {} s", figure(level), figure(1.0 / level)),
        "the error of a hysteresis model changes with every turn of the motion: tens to hundreds of rad/s are usual; check the unit (rad/s; per run)",
    );
}

/// The drift estimate is the slower of the two.
pub(super) fn drift_behind_level(facts: &Facts, found: &mut Found) {
    let Some([(level_key, level), (key, drift)]) = bandwidths(facts) else { return };
    if facts.model.adaptation.mode != AdaptationMode::Pcc
        || level == 0.0
        || drift == 0.0
        || SOUND_DRIFT.contains(&(drift / level))
    {
        return;
    }
    let how = if drift > level { "is to follow faster than" } else { "is next to nothing beside" };
    found.add(
        codes::DRIFT_ODD,
        &key,
        format!("the drift estimate, at {} rad/s, {how} the level estimate, at {} rad/s", figure(drift), figure(level)),
        &format!("the paper has a twentieth: check the units of `{key}` and `{level_key}`, and that the two are not in each other's place"),
    );
}
