//! Slips of engineers in their first hour, each with the key that the first finding should be about, and with what its help
//! should say. Written down before the messages were looked at; no message is a reason to change a line here.

use crate::physical_lint::support::spec;

use super::edit::Edit;
use specgen_tests::cases::{self, Case};

/// A change by its name: the text of the spec before and after.
pub type Change = (&'static str, fn(&str) -> String);

/// The spec that a slip is made in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Of {
    /// `own.toml`: six gauges see the platform.
    Own,
    /// `small.toml`: each leg has its own gauge.
    Small,
    /// `specs/reference.toml`.
    Reference,
    /// `specs/features/platform-gains.toml`.
    Gains,
    /// `specs/features/platform-environment.toml`.
    WorkPiece,
    /// `specs/features/platform-calibration.toml`.
    Calibrated,
    /// `specs/features/platform-joints.toml`.
    Joints,
    /// `specs/features/triggers.toml`.
    Triggers,
    /// `specs/legs.toml`.
    Legs,
}

impl Of {
    fn named(name: &str) -> Self {
        let all = [
            Self::Own,
            Self::Small,
            Self::Reference,
            Self::Gains,
            Self::WorkPiece,
            Self::Calibrated,
            Self::Joints,
            Self::Triggers,
            Self::Legs,
        ];
        all.into_iter().find(|of| format!("{of:?}") == name).expect("a spec")
    }

    /// The spec as it is.
    pub fn text(self) -> String {
        match self {
            Self::Own => include_str!("own.toml").to_owned(),
            Self::Small => include_str!("small.toml").to_owned(),
            Self::Reference => spec("reference.toml"),
            Self::Gains => spec("features/platform-gains.toml"),
            Self::WorkPiece => spec("features/platform-environment.toml"),
            Self::Calibrated => spec("features/platform-calibration.toml"),
            Self::Joints => spec("features/platform-joints.toml"),
            Self::Triggers => spec("features/triggers.toml"),
            Self::Legs => spec("legs.toml"),
        }
    }
}

/// One slip.
#[derive(Debug)]
pub struct Slip {
    pub of: Of,
    pub kind: &'static str,
    pub edits: Vec<Edit>,
    /// Key paths, without the index of a list's item: the first finding is about one of these. Two where nobody can know which.
    pub keys: Vec<&'static str>,
    /// The help says one of these.
    pub fix: Vec<&'static str>,
}

impl Slip {
    fn new(case: Case, functions: &[Change]) -> Self {
        let case: &'static Case = Box::leak(Box::new(case));
        let pair = |text: &'static str| text.split_once([' ', '\n']).expect("a key and what is new");
        let mut texts = case.all('+');
        let edits = case.parts.iter().filter_map(|(sign, text)| match sign {
            'v' => Some(Edit::Value(pair(text).0, pair(text).1)),
            'n' => Some(Edit::Rename(pair(text).0, pair(text).1)),
            'l' => Some(Edit::Line(pair(text).0, pair(text).1)),
            'r' => Some(Edit::Remove(text)),
            'a' => Some(Edit::Add(pair(text).0.trim_start_matches('.'), pair(text).1)),
            'x' => Some(Edit::Swap(pair(text).0, pair(text).1)),
            '-' => Some(Edit::Text(text, texts.next().expect("a new text"))),
            'f' => {
                let known = functions.iter().find(|(name, _)| *name == text.as_str());
                let (_, change) = known.unwrap_or_else(|| panic!("no function {text}"));
                Some(if text.contains(": ") { Edit::With(*change) } else { Edit::Record(*change) })
            }
            _ => None,
        });
        let edits: Vec<Edit> = edits.collect();
        let keys = case.one('k').expect("keys").split(' ').map(|key| if key == "record" { "" } else { key });
        let fix = case.one('h').map_or(Vec::new(), |help| help.lines().collect());
        Self { of: Of::named(case.one('@').expect("a spec")), kind: &case.title, edits, keys: keys.collect(), fix }
    }
}

/// Slips of a file in `tests/cases`, with what functions in it do.
pub fn slips(file: &str, functions: &[Change]) -> Vec<Slip> {
    let cases = cases::read(&specgen_tests::repository().join("tests/cases").join(file));
    cases.into_iter().map(|(case, _)| Slip::new(case, functions)).collect()
}

/// Changes of a record.
pub const RECORDS: &[Change] = &[
    ("time times 1000", |text| scaled(text, 0, 1e3)),
    ("displacement times 1000", |text| scaled(text, 2, 1e3)),
    ("displacement by 1000", |text| scaled(text, 2, 1e-3)),
    ("drive by 10", |text| scaled(text, 1, 0.1)),
    ("displacement negated", |text| scaled(text, 2, -1.0)),
    ("time_s named time_ms", |text| text.replacen("time_s", "time_ms", 1)),
    ("displacement_um named displacement", |text| text.replacen("displacement_um", "displacement", 1)),
    ("decimal commas", |text| text.replace('.', ",")),
];

/// A record with one column times a factor.
fn scaled(record: &str, column: usize, factor: f64) -> String {
    let mut lines = record.lines();
    let mut text = format!("{}\n", lines.next().unwrap());
    for line in lines {
        if line.starts_with('#') {
            text.push_str(line);
            text.push('\n');
            continue;
        }
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[column] = format!("{}", cells[column].parse::<f64>().unwrap() * factor);
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}
