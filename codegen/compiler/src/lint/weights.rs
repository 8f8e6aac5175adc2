//! Speed of the run-to-run adaptation, and the range of gains.

use super::{Facts, Findings, figure};
use specgen_language::model::AdaptationMode;

lints! {
    rules: ratio_of_gains, adapts_in_time, drift_behind_level;

    /// # W0835: implausible gain ratio
    ///
    /// `adaptation.gain_ratio` should lie between 0.2 and 4.
    ///
    /// ## Why it matters
    ///
    /// λ is the gain of the stack over the identified gain. It is about 0.5 at small
    /// signals and 0.25 at cryogenic temperature. No temperature or amplitude changes
    /// it more.
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
    /// 0.5 to 1.5 is a wide range.
    ///
    /// ```toml
    /// gain_ratio = [0.9, 1.1]
    /// ```
    GAIN_RATIO_ODD = "W0835";

    /// # W0836: adaptation too slow
    ///
    /// The level estimate should follow within half a second.
    ///
    /// ## Why it matters
    ///
    /// The error of a hysteresis model changes at every reversal of the motion. An
    /// estimate that is slower than the motion corrects the error of an earlier branch.
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
    /// Check the unit; some hundred rad/s are usual.
    ///
    /// ```toml
    /// level_bandwidth = "1260 rad/s"
    /// ```
    ADAPTATION_SLOW = "W0836";

    /// # W0837: drift and level estimates do not match
    ///
    /// The drift estimate of PCC (AII.6) should be slower than the level estimate, but
    /// less than two thousand times slower.
    ///
    /// ## Why it matters
    ///
    /// If it is faster, it extrapolates noise as drift. If it is two thousand times
    /// slower, it has no effect. Often the two values are swapped.
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
    /// A twentieth of the level bandwidth is usual.
    DRIFT_ODD = "W0837";
}

/// Plausible λ = ρ/ρ̂. Per volt, ceramics move half as far at small signals as over their range, and a quarter as far in liquid
/// nitrogen.
const SOUND_RATIO: core::ops::RangeInclusive<f64> = 0.2..=4.0;
/// Slowest adaptation, rad/s: half a second to correct the error of a hysteresis model, which changes at every reversal.
const SLOWEST: f64 = 2.0;
/// Bandwidth of the drift estimate over that of the level estimate.
const SOUND_DRIFT: core::ops::RangeInclusive<f64> = 5e-4..=1.0;

/// Checks that the range of gains is plausible.
fn ratio_of_gains(facts: &Facts, found: &mut Findings) {
    for (end, ratio) in facts.model.adaptation.gain_ratio.into_iter().enumerate() {
        if SOUND_RATIO.contains(&ratio) {
            continue;
        }
        found.add(
            GAIN_RATIO_ODD,
            &format!("adaptation.gain_ratio[{end}]"),
            format!("the loop would have to be stable for stacks with {} times the identified gain", figure(ratio)),
            "a stack's gain at small signals is about half of that over its range, at cryogenic temperature a quarter: 0.5 to 1.5 is a wide range",
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

/// Checks that the adaptation follows the error of the hysteresis model.
fn adapts_in_time(facts: &Facts, found: &mut Findings) {
    let Some([(key, level), _]) = bandwidths(facts) else { return };
    if level == 0.0 || level >= SLOWEST {
        return;
    }
    found.add(
        ADAPTATION_SLOW,
        &key,
        format!("the level estimate has a bandwidth of {} rad/s: it takes {} s to follow", figure(level), figure(1.0 / level)),
        "the error of a hysteresis model changes at every reversal of the motion: tens to hundreds of rad/s are usual; check the unit (rad/s; per run)",
    );
}

/// Checks that the drift estimate is the slower one, but not too slow.
fn drift_behind_level(facts: &Facts, found: &mut Findings) {
    let Some([(level_key, level), (key, drift)]) = bandwidths(facts) else { return };
    if facts.model.adaptation.mode != AdaptationMode::Pcc
        || level == 0.0
        || drift == 0.0
        || SOUND_DRIFT.contains(&(drift / level))
    {
        return;
    }
    let how = if drift > level { "would be faster than" } else { "has no effect compared with" };
    found.add(
        DRIFT_ODD,
        &key,
        format!("the drift estimate, at {} rad/s, {how} the level estimate, at {} rad/s", figure(drift), figure(level)),
        &format!(
            "the paper uses a twentieth: check the units of `{key}` and `{level_key}`, and whether they are swapped"
        ),
    );
}
