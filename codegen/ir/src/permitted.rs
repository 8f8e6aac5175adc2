//! Permitted ranges of settings, and largest numbers of a state: one table for the emitted `Config`, its snapshots and
//! `docs/settings.md`.

use serde::Serialize;

use super::LEGS;

/// The table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PermittedRanges {
    /// In the order of the emitted `CONFIG_NAMES`.
    pub settings: Vec<Setting>,
    /// Largest numbers of a state that depend on settings and gauges.
    pub state: State,
}

/// One setting, or six of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setting {
    /// Name, without the index of six.
    pub name: &'static str,
    /// Whether there are six.
    pub six: bool,
    /// Number of its output line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Unit, empty if dimensionless: of the first three, and of the last three.
    pub unit: [&'static str; 2],
    /// Range of the first three, and of the last three.
    pub range: [Range; 2],
    /// Documentation.
    pub doc: &'static str,
    /// Origin of the bounds.
    pub from: &'static str,
}

/// Least and largest value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Range {
    /// A choice, a count or a code.
    Whole(i32, i32),
    /// A number.
    Number(f64, f64),
}

/// Largest magnitudes; the constants of [`specgen_runtime::snapshot::Sizes`], where each is explained.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct State {
    /// m and rad.
    pub place: [f64; 6],
    /// m and rad.
    pub user: [f64; 6],
    /// m/s and rad/s.
    pub rate: [f64; 6],
    /// m/s² and rad/s².
    pub acceleration: [f64; 6],
    /// m and rad.
    pub pose: [f64; 6],
    /// m/s and rad/s.
    pub pose_rate: [f64; 6],
    /// m and rad.
    pub error: f64,
    /// m and rad, or m.
    pub apart: [f64; 6],
    /// N and N m.
    pub wrench: [f64; 6],
    /// m.
    pub leg: f64,
    /// m.
    pub leg_rate: f64,
    /// m and rad.
    pub line: f64,
    /// m and rad.
    pub request: f64,
    /// m, or V with a calibration.
    pub reading: f64,
    /// N/m and N m/rad.
    pub stiffness: f64,
}

impl Setting {
    /// Its words: name and range.
    pub fn words(&self) -> impl Iterator<Item = (String, Range)> {
        let Self { name, six, line, range: [first, last], .. } = *self;
        (0..if six { LEGS } else { 1 }).map(move |index| {
            let range = if index < LEGS / 2 { first } else { last };
            (line.or(six.then_some(index)).map_or(name.to_owned(), |index| format!("{name}[{index}]")), range)
        })
    }
}

impl PermittedRanges {
    /// Every word of the settings: name and range.
    pub fn words(&self) -> impl Iterator<Item = (String, Range)> {
        self.settings.iter().flat_map(Setting::words)
    }

    /// Names of the words, in order.
    pub fn names(&self) -> Vec<String> {
        self.words().map(|(name, _)| name).collect()
    }
}
