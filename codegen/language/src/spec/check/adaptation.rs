//! Weights, bandwidths and modes of the run-to-run adaptation. Stability needs the sampled leg and is checked later.

use super::{control, in_order};
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::keys::fields::Value as _;
use crate::model::AdaptationMode;
use crate::spec::findings::Findings;
use crate::spec::text::number;

const WHICH: [&str; 2] = ["level", "drift"];

fn uses(mode: AdaptationMode, which: &str) -> bool {
    match mode {
        AdaptationMode::Invhys => false,
        AdaptationMode::Ewma => which == "level",
        AdaptationMode::Pcc => true,
    }
}

pub(super) fn alternatives(f: &Fields, findings: &mut Findings) -> Option<()> {
    for which in WHICH {
        let (weight, bandwidth) = (format!("adaptation.{which}_weight"), format!("adaptation.{which}_bandwidth"));
        if f.given(&weight) && f.given(&bandwidth) {
            findings.add(
                codes::ALTERNATIVES,
                &bandwidth,
                f.span(&bandwidth),
                format!("`{bandwidth}` and `{weight}` are alternatives: each sets the weight of the {which} estimate"),
                "keep one of the two and remove the other".to_owned(),
            );
        }
    }
    Some(())
}

pub(super) fn weights_for_mode(f: &Fields, findings: &mut Findings) -> Option<()> {
    // The task-space controller has its own bandwidths, and uses both after a change of mode.
    if control::there(f).is_some() {
        return None;
    }
    let mode = AdaptationMode::read(f, "adaptation.mode")?;
    let word = f.choice("adaptation.mode")?;
    for which in WHICH {
        let (weight, bandwidth) = (format!("adaptation.{which}_weight"), format!("adaptation.{which}_bandwidth"));
        let given = [&weight, &bandwidth].into_iter().find(|path| f.given(path));
        match given {
            None if uses(mode, which) && !findings.mentions(&[&weight, &bandwidth]) => findings.add(
                codes::ALTERNATIVES,
                &weight,
                f.span("adaptation.mode"),
                format!("mode \"{word}\" needs `{weight}` or `{bandwidth}`"),
                match which {
                    "level" => "write level_weight = <number>, the weight of a new reading in the level estimate, per run, or level_bandwidth = \"<number> rad/s\"",
                    _ => "write drift_weight = <number>, the weight of a new reading in the drift estimate, per run, or drift_bandwidth = \"<number> rad/s\"; mode \"ewma\" needs neither",
                }
                .to_owned(),
            ),
            Some(path) if !uses(mode, which) => findings.add(
                codes::UNUSED_WEIGHT,
                path,
                f.span(path),
                format!("mode \"{word}\" does not use `{path}`: it is checked, and there for a change of mode while running"),
                "remove it, or choose the mode that uses it: \"ewma\" takes the level, \"pcc\" level and drift".to_owned(),
            ),
            _ => {}
        }
    }
    Some(())
}

pub(super) fn bandwidths_fit_period(f: &Fields, findings: &mut Findings) -> Option<()> {
    let period = f.number("timing.period")?;
    let run: u32 = f.whole("adaptation.run_interval")?;
    let interval = period * f64::from(run);
    for which in WHICH {
        let path = format!("adaptation.{which}_bandwidth");
        let Some(bandwidth) = f.number(&path) else {
            continue;
        };
        if bandwidth * interval > 1.0 {
            let (radians, seconds, plural) = (number(bandwidth), number(interval), if run == 1 { "" } else { "s" });
            let weight = number(bandwidth * interval);
            findings.add(
                codes::BANDWIDTH_TOO_HIGH,
                &path,
                f.span(&path),
                format!(
                    "{radians} rad/s over a run of {seconds} s ({run} tick{plural}) is a weight of {weight}, expected at most 1"
                ),
                format!(
                    "at most \"{} rad/s\" would do; or shorten `timing.period` or `adaptation.run_interval`",
                    rounded_down(1.0 / interval)
                ),
            );
        }
    }
    Some(())
}

pub(super) fn gain_ratio_in_order(f: &Fields, findings: &mut Findings) -> Option<()> {
    in_order(f, findings, "adaptation.gain_ratio", true)
}

/// To four digits and never above `value`: a recommended value must pass the check.
fn rounded_down(value: f64) -> String {
    let shown: f64 = number(value).parse().unwrap_or(value);
    if shown <= value { number(value) } else { number(value * (1.0 - 1e-3)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recommended_bandwidth_is_never_above_the_limit() {
        for i in 1..2000 {
            let value = 7.0 * f64::from(i) / 3.0;
            let shown: f64 = rounded_down(value).parse().expect("a number");
            assert!(shown <= value && shown > 0.99 * value, "{shown} for {value}");
        }
    }
}
