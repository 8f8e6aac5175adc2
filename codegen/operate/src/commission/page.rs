//! The page about a commissioning, `commission.md`: what was found, beside the spec, and what is left to do.

use std::fmt::Write as _;

use specgen_language::table::{left, right, row};

use super::state::{Figure, State, Step};
use crate::place::AXES;

/// What no record in place shows.
const NOT_FOUND: &str = "\
Not found in place: the absolute sensitivity of the gauges (a common factor of all gauges looks like one of all legs) needs a\n\
reference, see `specgen identify gauge`; mass and stiffness only as their ratio, from modes.\n";

/// The page.
pub(super) fn page(state: &State) -> String {
    let mut text = format!("# Commissioning of {}\n\n", state.name);
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(text, "spec {}", state.spec);
    if let Some(machine) = &state.machine {
        let _ = writeln!(text, "machine {machine}");
    }
    if let Some(written) = &state.written {
        let _ = writeln!(text, "commissioned spec {written}");
    }
    text += "\n```text\n";
    for step in Step::ALL {
        let (date, what) = match state.steps.get(&step) {
            None => ("", "open"),
            Some(passed) => (passed.date.as_str(), passed.skipped.as_deref().unwrap_or("done")),
        };
        row(&mut text, &[left(12), left(12), left(0)], &[&step.name(), &date, &what]);
    }
    text += "```\n";
    if !state.wiring.is_empty() {
        let _ = write!(text, "\n## Wiring\n\n```text\n{}```\n", state.wiring);
    }
    noise(state, &mut text);
    cross_talk(state, &mut text);
    legs(state, &mut text);
    acceptance(state, &mut text);
    text + "\n" + NOT_FOUND
}

/// A length or an angle in nm or nrad.
pub(super) fn nano(axis: usize, value: f64) -> String {
    format!("{:.2} {}", value * 1e9, if axis < 3 { "nm" } else { "nrad" })
}

fn noise(state: &State, text: &mut String) {
    if state.rest.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Noise at rest, without feedback\n\n```text");
    let columns = [left(4), right(14), right(14), right(14), right(14)];
    let mains = format!("{} Hz", state.mains);
    row(text, &columns, &[&"", &"off, rms", &mains, &"on, rms", &mains]);
    for (axis, name) in AXES.iter().enumerate() {
        let cell = |at: usize, of: fn(&super::state::Rest) -> &[f64; 6]| {
            state.rest.get(at).map_or_else(String::new, |rest| nano(axis, of(rest)[axis]))
        };
        let [off, hum] = [cell(0, |rest| &rest.rms), cell(0, |rest| &rest.mains)];
        row(text, &columns, &[name, &off, &hum, &cell(1, |rest| &rest.rms), &cell(1, |rest| &rest.mains)]);
    }
    *text += "```\n";
}

fn cross_talk(state: &State, text: &mut String) {
    let Some(coupling) = &state.cross_talk else { return };
    let most = coupling.matrix.iter().flatten().fold(0.0, |most: f64, entry| {
        let entry = entry.abs();
        if entry > most { entry } else { most }
    });
    let error = coupling.error;
    let _ = writeln!(text, "\n## Cross-talk\n\nLargest entry of E {most:.2e} ± {error:.0e} (standard error).");
}

fn legs(state: &State, text: &mut String) {
    if state.legs.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Legs\n\n```text");
    let columns = [left(4), right(12), right(10), right(12), right(12), left(0).behind("  ")];
    row(text, &columns, &[&"leg", &"gain um/V", &"to spec", &"fit, rms", &"arbitrary", &"model"]);
    for (number, leg) in state.legs.iter().enumerate() {
        let gain = format!("{:.5}", leg.gain * 1e6);
        let change = format!("{:+.2} %", 100.0 * (leg.gain / state.spec_gain - 1.0));
        let arbitrary = leg.arbitrary_rms.map_or_else(|| "-".to_owned(), |rms| nano(0, rms));
        row(text, &columns, &[&number, &gain, &change, &nano(0, leg.fit_rms), &arbitrary, &leg.model]);
    }
    *text += "```\n\nRms errors of the displacement: of the curves (held out if a model was chosen), and of the arbitrary record, by which the model was chosen.\n";
}

fn acceptance(state: &State, text: &mut String) {
    if state.acceptance.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Acceptance, by the gauges\n\n```text");
    let columns = [left(50), right(14), right(14), right(14), left(0).behind("  ")];
    row(text, &columns, &[&"", &"measured", &"computed", &"limit", &""]);
    for figure in &state.acceptance {
        let Figure { name, axis, value, computed, limit } = figure;
        let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| nano(*axis, value));
        let verdict = match limit {
            None => String::new(),
            Some((limit, key)) => format!("{} {key}", if value <= limit { "meets" } else { "MISSES" }),
        };
        let most = limit.as_ref().map(|(limit, _)| *limit);
        row(text, &columns, &[name, &nano(*axis, *value), &shown(*computed), &shown(most), &verdict]);
    }
    *text += "```\n";
}

/// The figures that miss their limits, as text; none if all meet them.
pub(super) fn missed(state: &State) -> Option<String> {
    let beyond = state.acceptance.iter().filter(|one| one.limit.as_ref().is_some_and(|(limit, _)| one.value > *limit));
    let names: Vec<&str> = beyond.map(|one| one.name.as_str()).collect();
    (!names.is_empty()).then(|| format!("beyond [requirements]: {}", names.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_every_figure_with_its_limit_and_what_is_open() {
        let figure = |value: f64| Figure {
            name: "hold z, rms".to_owned(),
            axis: 2,
            value,
            computed: Some(1e-9),
            limit: Some((5e-9, "requirements.noise".to_owned())),
        };
        let mut state = State { name: "stage".to_owned(), acceptance: vec![figure(4e-9)], ..State::default() };
        state.pass(Step::Curves, Some("no time".to_owned()));
        let text = page(&state);
        for part in ["# Commissioning of stage", "4.00 nm", "meets requirements.noise", "no time", "acceptance", "open"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(missed(&state).is_none() && !text.contains("## Legs"), "{text}");
        state.acceptance.push(figure(6e-9));
        assert!(page(&state).contains("MISSES requirements.noise"));
        assert_eq!(missed(&state).unwrap(), "beyond [requirements]: hold z, rms");
    }
}
