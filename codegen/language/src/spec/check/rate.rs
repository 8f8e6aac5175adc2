//! The rate dependence of the leg model: each option has its own keys.

use super::control;
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;
use crate::spec::keys;
use crate::spec::text::number;

/// Option and its keys.
const OPTIONS: [(&str, &[&str]); 2] =
    [("dynamic-preisach", &["rate_tables"]), ("creep", &["creep_times", "creep_weights"])];

pub(super) fn keys_of_option(f: &Fields, findings: &mut Findings) -> Option<()> {
    let chosen = f.choice("hysteresis.rate")?;
    for (option, names) in OPTIONS {
        let lines: Vec<String> =
            names.iter().filter_map(|name| Some(keys::key(&format!("hysteresis.{name}"))?.line())).collect();
        for key in names {
            let path = format!("hysteresis.{key}");
            let given = f.given(&path);
            if given && option != chosen {
                findings.add(
                    codes::RATE_KEYS,
                    &path,
                    f.span(&path),
                    format!("`{path}` belongs to rate = \"{option}\", but rate is \"{chosen}\""),
                    format!("write rate = \"{option}\", or remove `{key}`"),
                );
            } else if !given && option == chosen && !findings.mentions_item(&path) {
                findings.add(
                    codes::MISSING_KEY,
                    &path,
                    f.span("hysteresis.rate"),
                    format!("rate = \"{chosen}\" needs `{path}`"),
                    format!("write {}; `specgen identify rate` prints the lines", lines.join(" and ")),
                );
            }
        }
    }
    Some(())
}

pub(super) fn creep_lists(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "hysteresis.creep_weights";
    let (times, weights) = (f.numbers("hysteresis.creep_times")?, f.numbers(path)?);
    if times.len() != weights.len() {
        findings.add(
            codes::RATE_KEYS,
            path,
            f.span(path),
            format!("{} creep weights for {} time constants", weights.len(), times.len()),
            "give one weight for each time constant, in the same order".to_owned(),
        );
    }
    let sum = weights.iter().fold(0.0, |sum, weight| sum + weight);
    if sum >= 1.0 {
        findings.add(
            codes::RATE_KEYS,
            path,
            f.span(path),
            format!("the creep weights add up to {}: the leg would creep by more than its own motion", number(sum)),
            "weights are fractions of the static displacement; those of a piezo leg add up to about 0.1".to_owned(),
        );
    }
    Some(())
}

/// A model other than the Preisach table has its own creep.
pub(super) fn model_without_rate(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "hysteresis.rate";
    let (model, rate) = (f.choice("hysteresis.model")?, f.choice(path)?);
    if model != "preisach" && rate != "static" {
        findings.add(
            codes::RATE_KEYS,
            path,
            f.span(path),
            format!("model = \"{model}\" has its own creep, and cannot be used with rate = \"{rate}\""),
            "remove `rate` and its keys, or write model = \"preisach\"".to_owned(),
        );
    }
    Some(())
}

pub(super) fn dead_time_of_legs(f: &Fields, findings: &mut Findings) -> Option<()> {
    control::there(f)?;
    let path = "hysteresis.dead_time";
    let dead_time = f.number(path)?;
    if dead_time > 0.0 {
        findings.add(
            codes::LEG_KEY_WITH_CONTROL,
            path,
            f.span(path),
            format!("`{path}` cannot be used with [control]: there `control.lead` sets the lead of the legs"),
            format!("write control.lead = \"{} ms\", less half a period, in its place", number(dead_time * 1e3)),
        );
    }
    Some(())
}
