//! A spec that is wrong, its verdict, and the fix that the verdict's help gives.

use std::fs;
use std::path::Path;

use specgen::compile::compile;
use specgen::diagnostic::{Diagnostic, Place, Severity, render};
use specgen::outcome::Refusal;
use specgen_tests::repository;

/// A spec that is wrong, and how what the finding says fixes it.
pub struct Case {
    pub what: &'static str,
    /// Old and new text; the first place of the old text is replaced.
    pub edits: Vec<(&'static str, String)>,
    /// A table of poses beside the spec.
    pub table: Option<String>,
    pub code: &'static str,
    /// The text at which the finding stands: its line and column are those of the first place; none: the table.
    pub at: Option<&'static str>,
    /// Part of the message.
    pub says: &'static str,
    /// From the help and the wrong spec and table to the fixed ones.
    pub fix: fn(&str, &str, &str) -> (String, String),
}

pub fn reference() -> String {
    fs::read_to_string(repository().join("specs/reference.toml")).expect("a spec of this repository")
}

/// A folder with the records that the spec names.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("records")).expect("created");
    let record = "records/reference-forc.csv";
    fs::copy(repository().join("specs").join(record), folder.path().join(record)).expect("copied");
    folder
}

pub fn edited(text: &str, edits: &[(&'static str, String)]) -> String {
    edits.iter().fold(text.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "no `{old}`");
        text.replacen(old, new, 1)
    })
}

pub fn verdict(folder: &Path, text: &str, table: Option<&str>) -> Result<Vec<Diagnostic>, Refusal> {
    let path = folder.join("platform.toml");
    fs::write(&path, text).expect("written");
    if let Some(table) = table {
        fs::write(folder.join("table.csv"), table).expect("written");
    }
    compile(&path).map(|compiled| compiled.findings)
}

/// The number that follows `marker`.
pub fn after<'a>(help: &'a str, marker: &str) -> &'a str {
    let (_, rest) = help.split_once(marker).unwrap_or_else(|| panic!("no `{marker}` in: {help}"));
    let end = rest.find(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c))).unwrap_or(rest.len());
    rest[..end].trim_end_matches('.')
}

pub fn value(help: &str, marker: &str) -> f64 {
    let text = after(help, marker);
    text.parse().unwrap_or_else(|_| panic!("`{text}` after `{marker}` in: {help}"))
}

/// Line and column, from 1, of the first place of a text.
pub fn place_of(text: &str, part: &str) -> (usize, usize) {
    let at = text.find(part).unwrap_or_else(|| panic!("no `{part}`"));
    let line = text[..at].matches('\n').count() + 1;
    let begin = text[..at].rfind('\n').map_or(0, |end| end + 1);
    (line, text[begin..at].chars().count() + 1)
}

pub fn hold(cases: Vec<Case>) {
    let folder = folder();
    // Every third of a list in the short run.
    for case in cases.into_iter().step_by(specgen_tests::length(3, 1)) {
        let what = case.what;
        let bad = edited(&reference(), &case.edits);
        let Err(refused) = verdict(folder.path(), &bad, case.table.as_deref()) else { panic!("{what}: accepted") };
        let source = refused.source.expect("it was read");
        let shown = render(&refused.findings, &source, false);
        let found = refused
            .findings
            .iter()
            .find(|found| found.code == case.code)
            .unwrap_or_else(|| panic!("{what}: no {}:\n{shown}", case.code));
        assert_eq!(found.severity, Severity::Error, "{what}");
        assert!(specgen::findings::find(found.code).is_some(), "{what}");
        assert!(found.message.contains(case.says), "{what}: {}", found.message);
        match case.at {
            Some(at) => {
                let (line, column) = place_of(&bad, at);
                let place = format!("/platform.toml:{line}:{column}\n");
                assert!(shown.contains(&place), "{what}: no `{place}` in:\n{shown}");
                assert!(matches!(found.place, Place::Spec(_)), "{what}: {found:?}");
            }
            None => {
                let Place::File { path, .. } = &found.place else { panic!("{what}: {found:?}") };
                assert_eq!(path, "table.csv", "{what}");
                assert!(shown.contains("--> table.csv"), "{what}:\n{shown}");
            }
        }
        let (fixed, table) = (case.fix)(&found.help, &bad, case.table.as_deref().unwrap_or_default());
        assert!(fixed != bad || Some(&table) != case.table.as_ref(), "{what}: nothing fixed");
        if let Err(refused) = verdict(folder.path(), &fixed, case.table.is_some().then_some(&table)) {
            panic!(
                "{what}: the fix `{}` is refused in its turn:\n{}",
                found.help,
                render(&refused.findings, &source, false)
            );
        }
    }
}

pub const BIAS_Z: &str = "\"10 um\", \"0 urad\"";
pub const CASE_1: &str = "kind      = \"case-1\"\nfrequency = \"1 Hz\"";

pub fn case(
    what: &'static str,
    edits: &[(&'static str, &str)],
    (code, at, says): (&'static str, &'static str, &'static str),
    fix: fn(&str, &str, &str) -> (String, String),
) -> Case {
    let edits = edits.iter().map(|(old, new)| (*old, (*new).to_owned())).collect();
    Case { what, edits, table: None, code, at: Some(at), says, fix }
}

/// The spec with `old` replaced by `new`, the table unchanged.
pub fn put(bad: &str, old: &str, new: &str) -> (String, String) {
    assert!(bad.contains(old), "no `{old}`");
    (bad.replacen(old, new, 1), String::new())
}

/// The reference with `table.csv` for its first trajectory.
pub fn with_table(
    what: &'static str,
    table: String,
    code: &'static str,
    says: &'static str,
    fix: fn(&str, &str, &str) -> (String, String),
) -> Case {
    let spec = "kind   = \"waveform\"\nfile   = \"table.csv\"\nperiod = \"1 ms\"";
    Case { what, edits: vec![(CASE_1, spec.to_owned())], table: Some(table), code, at: None, says, fix }
}
