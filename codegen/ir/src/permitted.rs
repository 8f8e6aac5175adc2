//! What settings may be and how large the numbers of a state may become: one table for the emitted `Config`, its snapshots and
//! `docs/settings.md`.

use serde::Serialize;

use super::LEGS;

/// The table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PermittedRanges {
    /// In the order of the emitted `CONFIG_NAMES`.
    pub settings: Vec<Setting>,
    /// Numbers of a state that settings and gauges decide about.
    pub state: State,
}

/// One setting, or six of a kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setting {
    /// Name; of six, without the index.
    pub name: &'static str,
    /// Whether there are six of it.
    pub six: bool,
    /// Number of the output line that it is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Unit; empty without dimension. Of six, that of the first three and of the others.
    pub unit: [&'static str; 2],
    /// Least and largest value, of the first three and of the others.
    pub range: [Range; 2],
    /// What it is.
    pub doc: &'static str,
    /// Where the bounds come from.
    pub from: &'static str,
}

/// Least and largest value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Range {
    /// Of a choice, a count or a code.
    Whole(i32, i32),
    /// Of a number.
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
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.words().map(|(name, _)| name).collect()
    }
}
