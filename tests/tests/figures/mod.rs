//! Measured figures held against committed ones: a file of `tests/budgets` has them by name and by version of the cross
//! compiler. With `SPECGEN_BLESS=1` in the environment the present ones are committed anew.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use specgen::budget::group;
use specgen::verify::Measurement;
use specgen_tests::{repository, skipped};

/// A figure may grow by this share of the committed one, and by as much, before it is a regression.
const GROWTH: (f64, f64) = (0.03, 2.0);
/// Tests of one binary run at the same time.
static FILE: Mutex<()> = Mutex::new(());

/// Version of the cross compiler whose figures the pages of `docs` show.
const SHOWN: &str = "1.95";

/// What [`cost`] has.
const COST: [&str; 5] = [
    "instructions, step",
    "instructions, actuate",
    "instructions, actuate at most",
    "bytes of State",
    "bytes of stack",
];

/// Figures by their names, such as `instructions, step`.
pub type Figures = BTreeMap<String, f64>;
/// By what was measured, then by version of the cross compiler.
pub type Table = BTreeMap<String, BTreeMap<String, Figures>>;

fn path(file: &str) -> PathBuf {
    repository().join("tests/budgets").join(file)
}

pub fn table(file: &str) -> Table {
    let text = fs::read_to_string(path(file)).unwrap_or_else(|_| "{}".to_owned());
    serde_json::from_str(&text).expect("committed figures")
}

/// A committed figure, rounded up, in words of the pages.
pub fn figure(file: &str, name: &str, what: &str) -> String {
    let table = table(file);
    let figures = table.get(name).and_then(|versions| versions.get(SHOWN));
    let value = figures.and_then(|figures| figures.get(what));
    group(value.unwrap_or_else(|| panic!("{file}: no {what} of {name} for {SHOWN}")).ceil() as u64)
}

/// What a tick costs: mean instructions, those of a leg, mean and most; bytes of state and stack.
pub fn cost(m: &Measurement) -> Figures {
    let [step, leg] = ["step", "actuate"].map(|name| m.stage(name).unwrap_or_else(|| panic!("no stage {name}")));
    let stack = m.checks.stack.expect("a bound") as f64;
    let values = [step.mean.ceil(), leg.mean.ceil(), leg.max as f64, m.state as f64, stack];
    COST.into_iter().map(str::to_owned).zip(values).collect()
}

/// Columns of a table of such costs.
pub fn cost_columns(file: &str, name: &str) -> String {
    let [step, leg, longest_leg, state, stack] = COST.map(|what| figure(file, name, what));
    format!("{step} | {leg}, {longest_leg} | {state} | {stack}")
}

/// A page of `docs` has these rows of tables, by their first cell; with `SPECGEN_BLESS=1` in the environment they are written into it.
pub fn shown(page: &str, rows: &[String]) {
    let _one = FILE.lock().unwrap_or_else(PoisonError::into_inner);
    let path = repository().join("docs").join(page);
    let text = fs::read_to_string(&path).expect("the page");
    let first = |line: &str| line.split('|').nth(1).map(str::to_owned);
    let line = |line: &str| {
        let row = rows.iter().find(|row| line.starts_with('|') && first(row) == first(line));
        row.map_or(line, String::as_str).to_owned()
    };
    let lines: Vec<String> = text.lines().map(line).collect();
    for row in rows {
        assert_eq!(lines.iter().filter(|line| *line == row).count(), 1, "docs/{page}: no place for {row}");
    }
    let expected = lines.join("\n") + "\n";
    if is_to_bless() {
        fs::write(&path, expected).expect("the repository is writable");
    } else {
        let stale: Vec<_> = expected.lines().zip(text.lines()).filter(|(new, old)| new != old).collect();
        assert!(stale.is_empty(), "docs/{page}; SPECGEN_BLESS=1 writes what is committed: {stale:#?}");
    }
}

fn is_to_bless() -> bool {
    std::env::var_os("SPECGEN_BLESS").is_some_and(|value| value == "1")
}

/// `1.96` of `rustc 1.96.0 (… …)`: a patch changes no code generation.
fn minor_version(compiler: &str) -> String {
    let version = compiler.split_whitespace().find(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    version.unwrap_or(compiler).split('.').take(2).collect::<Vec<_>>().join(".")
}

/// Every figure that has grown beyond what is allowed, has no committed one, or is committed and was not measured, in words.
fn grown(committed: &Figures, found: &Figures) -> Vec<String> {
    let mut grown = Vec::new();
    for (name, value) in found {
        match committed.get(name) {
            None => grown.push(format!("{name}: no committed figure")),
            Some(old) if *value > old * (1.0 + GROWTH.0) + GROWTH.1 => {
                grown.push(format!("{name}: {value}, committed {old}"));
            }
            Some(_) => {}
        }
    }
    let lost = committed.keys().filter(|name| !found.contains_key(*name));
    grown.extend(lost.map(|name| format!("{name}: committed, and not measured")));
    grown
}

/// Holds `found` against the committed figures of `name` in `file`, or commits them; every figure that has grown, in words.
pub fn held(file: &str, name: &str, compiler: &str, found: Figures) -> Vec<String> {
    let _one = FILE.lock().unwrap_or_else(PoisonError::into_inner);
    let version = minor_version(compiler);
    let mut committed = table(file);
    if is_to_bless() {
        committed.entry(name.to_owned()).or_default().insert(version, found);
        let text = serde_json::to_string_pretty(&committed).expect("plain data") + "\n";
        fs::write(path(file), text).expect("the repository is writable");
        return Vec::new();
    }
    let Some(old) = committed.get(name) else {
        return vec![format!("{name}: no committed figures: SPECGEN_BLESS=1 adds them")];
    };
    let Some(old) = old.get(&version) else {
        skipped(&format!("no committed figures of {name} for rustc {version}: SPECGEN_BLESS=1 adds them"));
        return Vec::new();
    };
    let said = |grown: String| format!("{name}: {grown}; if that must be: SPECGEN_BLESS=1 renews the figures");
    grown(old, &found).into_iter().map(said).collect()
}

#[test]
fn growth_by_four_percent_and_a_new_figure_are_seen() {
    let committed =
        Figures::from([("step", 4000.0), ("notch", 200.0), ("stack", 288.0)].map(|(k, v)| (k.to_owned(), v)));
    assert_eq!(grown(&committed, &committed), Vec::<String>::new());
    for (stage, factor, expected) in
        [("step", 1.04, 1), ("step", 1.02, 0), ("step", 0.5, 0), ("notch", 1.05, 1), ("notch", 0.5, 0)]
    {
        let mut found = committed.clone();
        *found.get_mut(stage).unwrap() *= factor;
        assert_eq!(grown(&committed, &found).len(), expected, "{stage} × {factor}");
    }
    let all = committed.iter().map(|(name, value)| (name.clone(), 1.1 * value)).collect();
    assert_eq!(grown(&committed, &all).len(), 3);
    let found = Figures::from([("another".to_owned(), 1.0)]);
    assert_eq!(grown(&committed, &found).len(), 4);
    assert!(grown(&committed, &found).contains(&"another: no committed figure".to_owned()));
    assert_eq!(grown(&committed, &Figures::new()).len(), 3, "nothing measured");
    assert!(held("platform.json", "no such controller", "rustc 1.95.0 (x)", found)[0].contains("no committed figures"));
    assert_eq!(minor_version("rustc 1.96.0 (ac68faa20 2026-05-25)"), "1.96");
}
