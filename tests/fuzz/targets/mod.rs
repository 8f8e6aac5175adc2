//! What takes bytes from outside, and what must hold whatever they are. A target panics where it does not.

pub mod container;
mod link;
mod memory;
mod record;

use std::path::PathBuf;

use specgen::diagnostic::{Diagnostic, Place, Severity, render, to_json};
use specgen::findings;
use specgen::identify::{Input, gauge, parse_record, read_table_csv, response, stiffness, write_table_csv};
use specgen::operate::{Command, read_wave};
use specgen::spec::{self, SpecSource};
use specgen::{lint, waveform};

/// A target and its name, which is also that of the folder of its kept inputs.
type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 9] = [
    ("spec", spec),
    ("csv", csv),
    ("mat", container::mat),
    ("hdf5", container::hdf5),
    ("tdms", container::tdms),
    ("packed", container::packed),
    ("record", record::record),
    ("link", link::link),
    ("operator", operator),
];

/// A spec is accepted, or refused with findings that can be shown; what is accepted has a physical lint.
fn spec(input: &[u8]) {
    let text = String::from_utf8_lossy(input).into_owned();
    // The repository's, from its root or from the tests' folder: the records that a spec names are looked for there.
    let dir = ["specs", "../specs"].map(PathBuf::from).into_iter().find(|dir| dir.is_dir()).unwrap_or_default();
    let source = SpecSource { display_name: "fuzz.toml".to_owned(), text, dir };
    let (model, findings) = spec::load(&source);
    assert_eq!(model.is_none(), findings.iter().any(|finding| finding.severity == Severity::Error), "{findings:?}");
    shown(&findings, &source);
    if let Some(model) = model {
        shown(&lint::check(&model), &source);
    }
}

/// Each finding can be shown, without a control character of the input.
fn shown(findings: &[Diagnostic], source: &SpecSource) {
    findings.iter().for_each(|finding| assert_sound(finding, &source.text));
    let text = render(findings, source, false);
    assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
    let _ = render(findings, source, true);
    assert_eq!(to_json(findings, source).as_array().map(Vec::len), Some(findings.len()));
}

/// A finding about a spec has a known code, words, and a place within its text.
pub fn assert_sound(finding: &Diagnostic, text: &str) {
    assert!(!finding.message.is_empty() && !finding.help.is_empty(), "{finding:?}");
    assert!(findings::find(finding.code).is_some(), "{finding:?}");
    // A number that is computed is one; what a spec says may be shown as it stands.
    let words = format!("{} {}", finding.message, finding.help);
    let is_none = |word: &str| word == "NaN" && !text.contains("NaN");
    assert!(!words.split(|letter: char| !letter.is_alphanumeric()).any(is_none), "{finding:?}");
    match &finding.place {
        Place::Spec(span) => {
            assert!(span.start <= span.end && span.end <= text.len(), "{finding:?} in {} bytes", text.len());
            assert!(text.is_char_boundary(span.start) && text.is_char_boundary(span.end), "{finding:?}");
        }
        Place::Whole => {}
        Place::File { .. } => panic!("loading reads no other file: {finding:?}"),
    }
}

/// A table of numbers is read by everything that reads such tables.
fn csv(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    if let Some(record) = accepted(parse_record(&text, FILE)) {
        let columns = [&record.time, &record.drive, &record.displacement];
        assert!(columns.iter().all(|column| column.len() >= 100 && column.iter().all(|value| value.is_finite())));
        assert!(record.time.is_sorted_by(|a, b| a < b));
    }
    if let Some(table) = accepted(waveform::parse(&text, FILE, 1e-4, None)) {
        assert!(table.rows.len() >= 2 && table.rows.as_flattened().iter().all(|value| value.is_finite()));
    }
    if let Some(table) = accepted(read_table_csv(&text, FILE)) {
        let again = accepted(read_table_csv(&write_table_csv(&table), FILE));
        assert_eq!(again.map(|again| again.grid), Some(table.grid));
    }
    let _ = accepted(gauge::calibrate(Input::Text(&text), FILE, None));
    let _ = accepted(stiffness::measure(Input::Text(&text), FILE));
    let _ = accepted(response::respond(Input::Text(&text), FILE, None));
}

/// Name of a file of numbers.
const FILE: &str = "fuzz.csv";

/// What came out; what is refused comes with an error, and each finding with words and with the file.
fn accepted<T>(outcome: Result<T, Vec<Diagnostic>>) -> Option<T> {
    let findings = match outcome {
        Ok(value) => return Some(value),
        Err(findings) => findings,
    };
    assert!(findings.iter().any(|finding| finding.severity == Severity::Error), "{findings:?}");
    for finding in &findings {
        assert!(!finding.message.is_empty() && !finding.help.is_empty(), "{finding:?}");
        assert!(findings::find(finding.code).is_some(), "{finding:?}");
        assert!(
            matches!(&finding.place, Place::File { path, line } if path == FILE && *line != Some(0)),
            "{finding:?}"
        );
    }
    None
}

/// The lines that an operator types, and the file of a wave.
fn operator(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    for line in text.lines() {
        if let Err(why) = Command::parse(line) {
            assert!(!why.is_empty());
        }
    }
    for single in [false, true] {
        match read_wave(&text, 1e-4, single) {
            Ok(wave) => assert!(!wave.words.is_empty()),
            Err(why) => assert!(!why.is_empty()),
        }
    }
}
