//! The page about a commissioning, `commission.md`: what was found, beside the spec, and what is left to do.

use std::fmt::Write as _;

use specgen_language::table::{left, right, row};

use super::findings::findings;
use super::state::{Figure, LearnedFigure, Leg, State, Step};
use crate::place::AXES;

/// Width of the page, in characters.
const WIDTH: usize = 80;
/// What no record in place shows.
const NOT_FOUND: &str = "Not found in place: the absolute sensitivity of the gauges (a common factor of all gauges looks like one \
of all legs) needs a reference: record a gauge beside one over its range, and give both to `specgen identify gauge`. Mass and \
stiffness: only their ratio shows in modes.";
/// How figures are judged.
const ACCEPTED: &str = "By the gauges, rms unless noted. Computed: the same motions on the simulated machine, each leg its \
identified model, off by its error on the arbitrary record.";
const SENSITIVE: &str = "Error with feedback over error without it, for waves of the set-point along each axis; computed: the loop of \
the spec, for the same directions. Feed-forward is the same in both runs, so it cancels. m: beside a mode.";

/// The page.
pub(super) fn page(state: &State) -> String {
    let mut text = format!("# Commissioning of {}\n\n", state.name);
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(text, "spec {}", state.spec);
    if let Some(machine) = &state.machine {
        let _ = writeln!(text, "machine {machine}");
    }
    if let Some(written) = &state.written {
        let _ = writeln!(text, "commissioned {written}");
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
        let _ = write!(text, "\n## Wiring\n\n```text\n{}```\n", wrapped(&state.wiring));
    }
    noise(state, &mut text);
    text += &state.response.as_ref().map_or_else(String::new, super::response::section);
    cross_talk(state, &mut text);
    legs(state, &mut text);
    before_and_after(state, &mut text);
    acceptance(state, &mut text);
    sensitivity(state, &mut text);
    learned(state, &mut text);
    let found = findings(state);
    if !found.is_empty() {
        text += "\n## Findings\n\n";
        found.iter().for_each(|finding| text += &format!("- {finding}\n"));
    }
    text += &format!("\n{}", wrapped(NOT_FOUND));
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// Lines of at most [`WIDTH`] characters; those that go on are indented as the first, by two more if it is.
fn wrapped(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let first = line.len() - line.trim_start().len();
        let indent = " ".repeat(if first > 0 { first + 2 } else { 0 });
        let (mut column, mut is_first) = (first, true);
        out += &" ".repeat(first);
        for word in line.split_whitespace() {
            let length = word.chars().count();
            if !is_first && column + 1 + length > WIDTH {
                out += &format!("\n{indent}");
                column = indent.len();
            } else if !is_first {
                out.push(' ');
                column += 1;
            }
            (is_first, column) = (false, column + length);
            out += word;
        }
        out.push('\n');
    }
    out
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
    let what = "Rms errors of the displacement: of the curves (held out if a model was chosen), and of the arbitrary record, \
                which no fit used (of several families, it chose one).";
    *text += &format!("```\n\n{}", wrapped(what));
}

/// What the first spec and the machine without feedback had, and what they have now.
fn before_and_after(state: &State, text: &mut String) {
    let hold = |axis: usize| state.acceptance.iter().find(|one| one.axis == axis && one.name.starts_with("hold"));
    let rest = state.rest.get(1).into_iter().flat_map(|rest| rest.rms.iter().enumerate());
    let noise = rest.filter_map(|(axis, before)| {
        Some((format!("noise at rest, {}", AXES[axis]), axis, *before, hold(axis)?.value))
    });
    let model = |(leg, (straight, found)): (usize, (&Option<f64>, &Leg))| {
        Some((format!("leg {leg}: error of its model, arbitrary record"), 0, (*straight)?, found.arbitrary_rms?))
    };
    let legs = state.straight.iter().zip(&state.legs).enumerate().filter_map(model);
    let all: Vec<(String, usize, f64, f64)> = noise.chain(legs).collect();
    if all.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Before and after\n\n```text");
    let columns = [left(44), right(14), right(14)];
    row(text, &columns, &[&"", &"before", &"after"]);
    for (name, axis, before, after) in all {
        row(text, &columns, &[&name, &nano(axis, before), &nano(axis, after)]);
    }
    let what = "Rms. Before: without feedback; a straight line of the gain in the first spec. After: the commissioned controller; the \
                identified model.";
    *text += &format!("```\n\n{}", wrapped(what));
}

fn acceptance(state: &State, text: &mut String) {
    if state.acceptance.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Acceptance\n\n```text");
    let columns = [left(32), right(13), right(13), right(13), left(0).behind("  ")];
    row(text, &columns, &[&"", &"measured", &"computed", &"limit", &""]);
    let mut keys: Vec<&str> = Vec::new();
    for figure in &state.acceptance {
        let Figure { name, axis, value, computed, limit } = figure;
        let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| nano(*axis, value));
        let verdict = match limit {
            None => "",
            Some((limit, _)) => {
                if value <= limit {
                    "meets"
                } else {
                    "MISSES"
                }
            }
        };
        if let Some((_, key)) = limit.as_ref().filter(|(_, key)| !keys.contains(&key.as_str())) {
            keys.push(key);
        }
        let most = limit.as_ref().map(|(limit, _)| *limit);
        row(text, &columns, &[name, &nano(*axis, *value), &shown(*computed), &shown(most), &verdict]);
    }
    let limits = if keys.is_empty() { "no limits".to_owned() } else { keys.join(", ") };
    *text += &format!("```\n\n{}", wrapped(&format!("{ACCEPTED} Limits: {limits}.")));
}

fn sensitivity(state: &State, text: &mut String) {
    if state.sensitivity.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Sensitivity |S|\n\n```text");
    let columns =
        [right(8), left(2), left(10).behind("  "), right(9), right(9), right(9), right(9), right(9), right(9)];
    row(text, &columns, &[&"Hz", &"", &"", &"x", &"y", &"z", &"rx", &"ry", &"rz"]);
    for one in &state.sensitivity {
        let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
        let measured = one.measured.map(shown);
        let computed = std::array::from_fn(|axis| shown(one.measured[axis].map(|_| one.computed[axis])));
        for (first, mode, what, [x, y, z, a, b, c]) in [
            (format!("{:.1}", one.hertz), if one.mode.is_some() { " m" } else { "" }, "measured", measured),
            (String::new(), "", "computed", computed),
        ] {
            row(text, &columns, &[&first, &mode, &what, &x, &y, &z, &a, &b, &c]);
        }
    }
    *text += &format!("```\n\n{}", wrapped(SENSITIVE));
}

fn learned(state: &State, text: &mut String) {
    if state.learned.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## Learned\n\n```text");
    let columns = [left(18), right(12), right(12), right(8), left(0).behind("  ")];
    row(text, &columns, &[&"trajectory, xyz", &"before", &"after", &"passes", &"correction"]);
    for LearnedFigure { trajectory, before, after, passes, correction } in &state.learned {
        row(text, &columns, &[trajectory, &nano(0, *before), &nano(0, *after), passes, correction]);
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
    use super::super::state::{Rest, Sensitivity};
    use super::*;

    #[test]
    fn a_page_has_every_figure_with_its_limit_and_what_is_open() {
        let figure = |value: f64| Figure {
            name: "hold, z".to_owned(),
            axis: 2,
            value,
            computed: Some(1e-9),
            limit: Some((5e-9, "requirements.noise".to_owned())),
        };
        let mut state = State { name: "stage".to_owned(), acceptance: vec![figure(4e-9)], ..State::default() };
        state.pass(Step::Curves, Some("no time".to_owned()));
        let text = page(&state);
        for part in
            ["# Commissioning of stage", "4.00 nm", "meets", "requirements.noise", "no time", "acceptance", "open"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        let sensitivity = |mode| Sensitivity {
            hertz: 361.5,
            mode,
            measured: [Some(1.05), None, Some(1.0), Some(0.99), Some(1.21), Some(100.0)],
            error: [0.01; 6],
            computed: [1.04; 6],
        };
        state.sensitivity = vec![sensitivity(Some(0))];
        state.rest = vec![Rest { rms: [123.45e-9; 6], mains: [0.0; 6], gauges: [0.0; 6], lines: Vec::new() }; 2];
        state.written = Some("0".repeat(64));
        state.learned = vec![LearnedFigure {
            trajectory: "case-1".to_owned(),
            before: 8e-9,
            after: 4e-9,
            passes: 3,
            correction: "learned-case-1.json".to_owned(),
        }];
        let text = page(&state);
        for part in
            ["361.5 m", "100.000", "learned-case-1.json", "noise at rest, z", "- |S| at 361.5 Hz, rz: above 1.5"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(missed(&state).is_none() && !text.contains("## Legs"), "{text}");
        state.acceptance.push(figure(6e-9));
        let text = page(&state);
        assert!(text.contains("MISSES") && text.contains("hold, z: 6.0 times its simulation"), "{text}");
        assert_eq!(missed(&state).unwrap(), "beyond [requirements]: hold, z");
    }
}
