//! Finds the one value that would explain most findings, and reports it first.
//!
//! A wrong unit causes a finding wherever the value is compared with others, often first at a key that is right. So the check
//! is repeated with each suspected value multiplied by powers of ten or negated. The change that removes most findings wins.

mod readings;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::{allow, check, figure};
use crate::reach;
use specgen_language::diagnostic::{Diagnostic, Place, Severity};
use specgen_language::spec::{self, SpecSource};

lints! {
    rules:;

    /// # W0893: one value that would explain several findings
    ///
    /// If there are several findings, the spec is checked again with one value
    /// changed by a power of ten, its sign or its order. The change that removes most
    /// findings is reported first.
    ///
    /// ## Why it matters
    ///
    /// One mistake in the voltage can cause ten findings about other keys. The value
    /// that explains most of them is the first to check.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -voltage         = ["0 V", "100 V"]
    /// +voltage         = ["0 V", "100 mV"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check that value first; correcting it may remove the other findings.
    ///
    /// ```toml
    /// voltage         = ["0 V", "100 V"]
    /// ```
    ONE_VALUE = "W0893";
}

/// Changes to try, the likeliest mistakes first. The first [`OF_UNITS`] apply only to numbers with a unit.
const SLIPS: [(f64, &str); 11] = [
    (1e3, "1000 times larger"),
    (1e-3, "1000 times smaller"),
    (1e6, "a million times larger"),
    (1e-6, "a million times smaller"),
    (10.0, "ten times larger"),
    (0.1, "ten times smaller"),
    (100.0, "a hundred times larger"),
    (0.01, "a hundred times smaller"),
    (2.0, "twice as large"),
    (0.5, "half as large"),
    (-1.0, "negated"),
];
const OF_UNITS: usize = 4;
/// With more suspects than this, there is probably more than one mistake.
const MOST_SUSPECTS: usize = 40;

/// Codes and keys of the findings of the first phases, without records and paths.
type Names = BTreeSet<(&'static str, String)>;

struct Culprit {
    key: String,
    how: String,
    explained: usize,
    of: usize,
    /// A usual misunderstanding of the value.
    hint: Option<&'static str>,
}

/// A mistake that would explain findings.
struct Slip {
    /// Findings that would disappear, less twice those that would be new.
    score: usize,
    culprit: Culprit,
}

/// Order in which findings are shown: causes before consequences.
fn rank(one: &Diagnostic) -> u8 {
    let of_values = ["01", "02", "03", "08"].iter().any(|part| one.code[1..].starts_with(part));
    match (one.severity, of_values) {
        (Severity::Error, true) => 0,
        (Severity::Warning, true) => 1,
        (Severity::Error, false) => 2,
        (Severity::Warning, false) => 3,
        (Severity::Note, _) => 4,
    }
}

/// Sorts findings: first the one about the value that would explain most of them, then errors and warnings about values, then
/// those of later phases.
pub fn in_order(source: &SpecSource, findings: &mut Vec<Diagnostic>) {
    super::say_once(findings);
    findings.sort_by_key(rank);
    let Some(culprit) = culprit(source, findings) else { return };
    let own = |one: &Diagnostic| one.severity > Severity::Note && list_of(&one.key) == list_of(&culprit.key);
    // Prefer the finding about the same item of the list.
    let own =
        findings.iter().position(|one| own(one) && one.key == culprit.key).or_else(|| findings.iter().position(own));
    let (how, explained, of) = (&culprit.how, culprit.explained, culprit.of);
    let hint = culprit.hint.map_or_else(String::new, |hint| format!(": {hint}"));
    let explains = format!("if {how}, {explained} of {of} findings would disappear{hint}");
    let first = match own {
        Some(at) => {
            let mut own = findings.remove(at);
            own.help = format!("{}; {explains}", own.help);
            own
        }
        None => {
            let spans = spec::load_as_far(source).0.map(|model| model.spans).unwrap_or_default();
            let Some(span) = spans.get(&culprit.key) else { return };
            let message = format!("a mistake in `{}` would explain most of the following findings", culprit.key);
            let help = format!("check its unit, sign and order; {explains}");
            Diagnostic::new(ONE_VALUE, &culprit.key, Place::Spec(span.clone()), message, help)
        }
    };
    findings.insert(0, first);
}

fn list_of(key: &str) -> &str {
    key.rsplit_once('[').filter(|_| key.ends_with(']')).map_or(key, |(list, _)| list)
}

/// Findings of a text, and the places of its values; none if it cannot be read completely.
fn found(source: &SpecSource) -> Option<(Names, BTreeMap<String, Range<usize>>)> {
    let (model, mut findings) = spec::load_as_far(source);
    let model = model?;
    findings.extend(reach::check_bounds(&model));
    findings.extend(check(&model));
    allow(&model, &mut findings);
    findings.retain(|one| one.severity > Severity::Note);
    Some((findings.into_iter().map(|one| (one.code, one.key)).collect(), model.spans))
}

fn culprit(source: &SpecSource, findings: &[Diagnostic]) -> Option<Culprit> {
    if findings.iter().filter(|one| one.severity > Severity::Note).count() < 2 {
        return None;
    }
    let (base, spans) = found(source)?;
    if base.len() < 2 {
        return None;
    }
    let mut suspects = suspects(findings, &spans);
    if suspects.len() > MOST_SUSPECTS {
        return None;
    }
    let model = spec::load_as_far(source).0?;
    // If both are given at the amplifier's input, they match each other but nothing else.
    if model.dac.range == model.actuator.voltage {
        let items =
            ["actuator.voltage", "dac.range"].map(|list| [0, 1].map(|item| spans.get(&format!("{list}[{item}]"))));
        let mut places: Vec<Range<usize>> = items.into_iter().flatten().flatten().cloned().collect();
        places.sort_by_key(|place| place.start);
        suspects.push(("actuator.voltage".to_owned(), places));
    }
    let explained = |key: &str, text: String, how: String| -> Option<Slip> {
        let (now, _) = found(&SpecSource { text, ..source.clone() })?;
        let (gone, new) = (base.difference(&now).count(), now.difference(&base).count());
        // If all findings are about one list, they name it already.
        let lists: BTreeSet<&str> = base.difference(&now).map(|(_, key)| list_of(key)).collect();
        let score = gone.saturating_sub(2 * new);
        let hint = readings::hint(&model, list_of(key));
        let culprit = Culprit { key: key.to_owned(), how, explained: gone, of: base.len(), hint };
        (lists.len() >= 2 && score >= 2 && 2 * gone > base.len()).then_some(Slip { score, culprit })
    };
    // Of equal scores the first: the likeliest.
    let better = |best: Option<Slip>, one: Slip| match best {
        Some(best) if best.score >= one.score => Some(best),
        _ => Some(one),
    };
    let mut best: Option<Slip> = None;
    for (key, places) in &suspects {
        // This one explains everything.
        if best.as_ref().is_some_and(|best| best.score == base.len()) {
            break;
        }
        let tried = |factor: f64, of_unit: bool, how: &str, why: Option<&str>| {
            let text = changed(&source.text, places, factor, of_unit)?;
            // A single value is shown as it would be written.
            let written = match places.as_slice() {
                [place] => format!("written as {}", &text[place.start..place.end + text.len() - source.text.len()]),
                [_, _, _, _] if key == "actuator.voltage" => format!("it and `dac.range` are {how}"),
                _ => how.to_owned(),
            };
            explained(key, text, why.map_or_else(|| written.clone(), |why| format!("{written} ({why})")))
        };
        let slips = SLIPS.into_iter().enumerate();
        let by_unit =
            slips.filter_map(|(index, (factor, how))| tried(factor, index < OF_UNITS, how, None)).fold(None, better);
        let readings = readings::of(&model, list_of(key));
        let by_rest = readings
            .iter()
            .filter_map(|one| {
                tried(one.factor, false, &format!("{} times as large", figure(one.factor)), Some(&one.why))
            })
            .fold(None, better);
        best = [both(by_rest, by_unit)].into_iter().flatten().fold(best, better);
    }
    for [a, b] in exchanged(findings, &spans) {
        let (first, second) =
            if spans[a].start < spans[b].start { (&spans[a], &spans[b]) } else { (&spans[b], &spans[a]) };
        let mut text = source.text.clone();
        text.replace_range(second.clone(), &source.text[first.clone()]);
        text.replace_range(first.clone(), &source.text[second.clone()]);
        best = explained(a, text, format!("swapped with `{b}`")).into_iter().fold(best, better);
    }
    best.map(|best| best.culprit)
}

/// The better of two explanations for one value; both if they score the same and differ.
fn both(first: Option<Slip>, second: Option<Slip>) -> Option<Slip> {
    let (mut first, second) = match (first, second) {
        (Some(first), Some(second)) => (first, second),
        (one, other) => return one.or(other),
    };
    if first.score != second.score {
        return Some(if first.score > second.score { first } else { second });
    }
    if !first.culprit.how.starts_with(&second.culprit.how) {
        first.culprit.how = format!("{}, or {}", first.culprit.how, second.culprit.how);
    }
    Some(first)
}

/// Pairs of keys that a finding suspects to be swapped.
fn exchanged<'a>(findings: &'a [Diagnostic], spans: &BTreeMap<String, Range<usize>>) -> Vec<[&'a str; 2]> {
    findings
        .iter()
        .filter(|one| one.help.contains("swapped"))
        .filter_map(|one| {
            let mut keys = one.help.split('`').skip(1).step_by(2).filter(|key| spans.contains_key(*key));
            Some([keys.next()?, keys.next()?])
        })
        .collect()
}

/// Values that findings name, in the order of the findings: each item, then the whole list; with the places of their literals.
fn suspects(findings: &[Diagnostic], spans: &BTreeMap<String, Range<usize>>) -> Vec<(String, Vec<Range<usize>>)> {
    let mut named: Vec<&str> = Vec::new();
    for finding in findings.iter().filter(|one| one.severity > Severity::Note) {
        named.push(&finding.key);
        for text in [&finding.message, &finding.help] {
            named.extend(text.split('`').skip(1).step_by(2));
        }
        // "[geometry]" means every value in that section.
        for (section, _) in finding.help.split('[').skip(1).filter_map(|rest| rest.split_once(']')) {
            let within = |key: &&String| key.rsplit_once('.').is_some_and(|(outer, _)| outer == section);
            named.extend(spans.keys().filter(within).map(String::as_str));
        }
    }
    let items = |list: &str| -> Vec<Range<usize>> {
        (0..).map_while(|index| spans.get(&format!("{list}[{index}]")).cloned()).collect()
    };
    let mut suspects: Vec<(String, Vec<Range<usize>>)> = Vec::new();
    let mut add = |key: &str, places: Vec<Range<usize>>| {
        if !places.is_empty() && suspects.iter().all(|(known, _)| known != key) {
            suspects.push((key.to_owned(), places));
        }
    };
    for key in named.into_iter().filter(|key| spans.contains_key(list_of(key))) {
        let list = list_of(key);
        let whole = items(list);
        if whole.is_empty() {
            add(list, vec![spans[list].clone()]);
        } else {
            whole.iter().enumerate().for_each(|(index, place)| add(&format!("{list}[{index}]"), vec![place.clone()]));
            add(list, whole);
        }
    }
    suspects
}

/// The text with every literal times `factor`; none if one is not a number, or lacks the unit that `of_unit` requires, or if
/// nothing would change.
fn changed(text: &str, places: &[Range<usize>], factor: f64, of_unit: bool) -> Option<String> {
    let mut changed = text.to_owned();
    let mut any = false;
    for place in places.iter().rev() {
        let literal = text.get(place.clone())?;
        let inner = literal.trim_matches('"').trim_start();
        let end = inner.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(inner.len());
        let number: f64 = inner[..end].parse().ok()?;
        // Rounded to the result of decimal arithmetic.
        let decimals = if SLIPS.iter().any(|(slip, _)| *slip == factor) { 12 } else { 3 };
        let scaled: f64 = format!("{:.decimals$e}", number * factor).parse().ok()?;
        any |= scaled != number;
        let quote = if literal.starts_with('"') { "\"" } else { "" };
        let whole = quote.is_empty() && number % 1.0 == 0.0 && !inner.contains(['.', 'e', 'E']);
        if (quote.is_empty() && of_unit) || (whole && scaled % 1.0 != 0.0) {
            return None;
        }
        let plain = whole || scaled == 0.0 || (1e-3..1e6).contains(&scaled.abs());
        let written = if plain { format!("{scaled}") } else { format!("{scaled:e}") };
        changed.replace_range(place.clone(), &format!("{quote}{written}{}{quote}", &inner[end..]));
    }
    any.then_some(changed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_are_scaled_with_their_units() {
        let text = "a = \"25 N/m\"\nb = [\"-1e2 um\", 3, 0.5]";
        let places: Vec<Range<usize>> = ["\"25 N/m\"", "\"-1e2 um\"", "3", "0.5"]
            .map(|one| text.find(one).unwrap())
            .into_iter()
            .zip([8, 9, 1, 3])
            .map(|(at, length)| at..at + length)
            .collect();
        let changed = changed(text, &places, 1000.0, false).unwrap();
        assert_eq!(changed, "a = \"25000 N/m\"\nb = [\"-100000 um\", 3000, 500]");
        assert_eq!(super::changed(text, &places, 1000.0, true), None, "3 and 0.5 have no unit");
        let file = std::slice::from_ref(&places[0]);
        assert_eq!(super::changed("a = \"leg.csv\"", file, 10.0, false), None);
    }
}
