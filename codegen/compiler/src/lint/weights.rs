//! How fast the run-to-run adaptation works, and for which gains.

use super::{Facts, Found, figure};
use specgen_language::model::AdaptationMode;

lints! {
    rules: ratio_of_gains, adapts_in_time, drift_behind_level;

    /// # W0835: a gain ratio that no stack has
    ///
    /// `adaptation.gain_ratio` should lie between 0.2 and 4.
    ///
    /// ## Why it matters
    ///
    /// λ is the gain of the stack over the identified one. At small signals it is
    /// about half of that over the range, in the cold a quarter; no temperature and
    /// no amplitude does more.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [adaptation] @@
    /// -gain_ratio = [0.9, 1.1]
    /// +gain_ratio = [0.09, 1.1]
    /// ```
    ///
    /// ## Fix
    ///
    /// 0.5 to 1.5 is a wide interval.
    ///
    /// ```toml
    /// gain_ratio = [0.9, 1.1]
    /// ```
    GAIN_RATIO_ODD = "W0835";

    /// # W0836: an adaptation that comes too late
    ///
    /// The level estimate should follow within half a second.
    ///
    /// ## Why it matters
    ///
    /// The error of a hysteresis model changes with every turn of the motion; an
    /// estimate that is slower than the motion corrects the error of the turn before.
    ///
    /// ## Example
    ///
    /// `specs/features/ewma-bandwidth.toml` with
    ///
    /// ```diff
    /// @@ [adaptation] @@
    /// -level_bandwidth = "1260 rad/s"
    /// +level_bandwidth = "1.26 rad/s"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check rad/s; some hundred are usual.
    ///
    /// ```toml
    /// level_bandwidth = "1260 rad/s"
    /// ```
    ADAPTATION_SLOW = "W0836";

    /// # W0837: a drift estimate that does not go with the level
    ///
    /// The drift estimate of PCC (AII.6) should be slower than that of the level, and
    /// not two thousand times slower.
    ///
    /// ## Why it matters
    ///
    /// Faster than the level it takes noise for drift and extrapolates it; two
    /// thousand times slower it does nothing. The two are often in each other's
    /// place.
    ///
    /// ## Example
    ///
    /// `specs/features/platform-gains.toml` with
    ///
    /// ```diff
    /// @@ [adaptation] @@
    /// -level_bandwidth = "450 rad/s"
    /// +level_bandwidth = "19.6 rad/s"
    /// @@ [adaptation] @@
    /// -drift_bandwidth = "19.6 rad/s"
    /// +drift_bandwidth = "450 rad/s"
    /// ```
    ///
    /// ## Fix
    ///
    /// A twentieth of the level's bandwidth is usual.
    DRIFT_ODD = "W0837";
}

/// λ = ρ/ρ̂ that a stack may have. At small signals ceramics move half as far per volt as over their range, in the cold of
/// liquid nitrogen a quarter.
const SOUND_RATIO: core::ops::RangeInclusive<f64> = 0.2..=4.0;
/// Slowest adaptation, rad/s: half a second to take out what a hysteresis model leaves, which changes with every turn.
const SLOWEST: f64 = 2.0;
/// Drift estimate over level estimate: slower, but not so slow that the level has long followed.
const SOUND_DRIFT: core::ops::RangeInclusive<f64> = 5e-4..=1.0;

/// Gains of stacks stay within a few times of what was identified.
fn ratio_of_gains(facts: &Facts, found: &mut Found) {
    for (end, ratio) in facts.model.adaptation.gain_ratio.into_iter().enumerate() {
        if SOUND_RATIO.contains(&ratio) {
            continue;
        }
        found.add(
            GAIN_RATIO_ODD,
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
fn adapts_in_time(facts: &Facts, found: &mut Found) {
    let Some([(key, level), _]) = bandwidths(facts) else { return };
    if level == 0.0 || level >= SLOWEST {
        return;
    }
    found.add(
        ADAPTATION_SLOW,
        &key,
        format!("the level estimate follows at {} rad/s: it takes {} s", figure(level), figure(1.0 / level)),
        "the error of a hysteresis model changes with every turn of the motion: tens to hundreds of rad/s are usual; check the unit (rad/s; per run)",
    );
}

/// The drift estimate is the slower of the two.
fn drift_behind_level(facts: &Facts, found: &mut Found) {
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
        DRIFT_ODD,
        &key,
        format!("the drift estimate, at {} rad/s, {how} the level estimate, at {} rad/s", figure(drift), figure(level)),
        &format!("the paper has a twentieth: check the units of `{key}` and `{level_key}`, and that the two are not in each other's place"),
    );
}
