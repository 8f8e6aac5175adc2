//! A figure of a platform, its limit, and its text.

use host_sim::coverage::Coverage;
use serde::Serialize;
use specgen_toolchain::budget::group;

specgen_language::named! {
    /// Subject of a figure: a line of the text, a row of a card.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Subject {
        /// Reach of each axis alone, from the middle of the strokes, µm and µrad; the limit is the declared workspace.
        Reach => "reach",
        /// Noise of the measured pose at rest, and of a reading, rms; `step`: the largest converter step, at a leg or the platform.
        Noise => "noise",
        /// Fit of the hysteresis tables to their records.
        Record => "record",
        /// Stability margins of the worst control mode.
        Margins => "margins",
        /// Errors along trajectories of the spec. [`Verdict::of`](super::Verdict::of) has none, but reports limits: they need
        /// a run.
        Tracking => "tracking",
        /// Instructions of a tick.
        Time => "time",
        /// Flash, RAM and stack; violations in the image.
        Memory => "memory",
        /// Whether host and microcontroller compute the same bits.
        Bits => "bits",
    }
}

/// Relation of a figure to its limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// Within the limit.
    Within,
    /// Beyond the limit: the platform is not ready.
    Beyond,
    /// There is no limit.
    NoLimit,
}

/// Limit of a figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// In the unit of the figure.
    pub value: f64,
    /// True for a lower limit, false for an upper limit.
    pub least: bool,
    /// Origin: a key of the spec, or the part.
    pub from: String,
}

/// A figure of the platform, and its limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is about.
    pub subject: Subject,
    /// Name within the subject, such as `z` or `flash`.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// The actual value is larger than `value`, where the search ended.
    pub more: bool,
    /// Unit of value and limit; empty for ratios.
    pub unit: &'static str,
    /// The limit, if the spec or the part has one.
    pub limit: Option<Limit>,
    /// Relation to the limit.
    pub mark: Mark,
    /// Text in place of a number.
    pub words: Option<String>,
    /// The measured part of a path, if any.
    #[serde(flatten)]
    pub coverage: Option<Coverage>,
}

impl Figure {
    /// A figure without limit.
    pub fn new(subject: Subject, name: &str, value: f64, unit: &'static str) -> Self {
        let name = name.to_owned();
        Self { subject, name, value, more: false, unit, limit: None, mark: Mark::NoLimit, words: None, coverage: None }
    }

    /// A fact as text, good or bad.
    pub fn fact(subject: Subject, name: &str, words: String, good: bool) -> Self {
        let mark = if good { Mark::Within } else { Mark::Beyond };
        Self { mark, words: Some(words), ..Self::new(subject, name, 0.0, "") }
    }

    /// A figure known only to be larger than `value`.
    pub fn more_than(subject: Subject, name: &str, value: f64, unit: &'static str) -> Self {
        Self { more: true, ..Self::new(subject, name, value, unit) }
    }

    /// Adds the measured part of a path.
    #[must_use]
    pub fn over(self, coverage: Coverage) -> Self {
        Self { coverage: Some(coverage), ..self }
    }

    /// Adds an upper limit and its origin.
    #[must_use]
    pub fn at_most(self, value: f64, from: &str) -> Self {
        let mark = if self.value <= value && !self.more { Mark::Within } else { Mark::Beyond };
        Self { mark, limit: Some(Limit { value, least: false, from: from.to_owned() }), ..self }
    }

    /// Adds a lower limit and its origin.
    #[must_use]
    pub fn at_least(self, value: f64, from: &str) -> Self {
        let mark = if self.value >= value { Mark::Within } else { Mark::Beyond };
        Self { mark, limit: Some(Limit { value, least: true, from: from.to_owned() }), ..self }
    }

    /// The value without its unit, in KiB for bytes; `> 5` if it is larger.
    pub fn value_text(&self) -> String {
        if self.more { format!("> {}", plain(self.value, self.unit)) } else { number(self.value, self.unit) }
    }

    /// Relation of value and limit: `≤`, `>`, `≥` or `<`; `None` without a limit.
    pub fn relation(&self) -> Option<&'static str> {
        let limit = self.limit.as_ref()?;
        Some(match (limit.least, self.mark) {
            (false, Mark::Beyond) => ">",
            (false, _) => "≤",
            (true, Mark::Beyond) => "<",
            (true, _) => "≥",
        })
    }

    /// The limit without its unit, formatted as the value; empty if there is none.
    pub fn limit_text(&self) -> String {
        self.limit.as_ref().map_or_else(String::new, |limit| plain(limit.value, self.unit))
    }
}

/// A specified number, which has few decimals.
fn plain(value: f64, unit: &str) -> String {
    let text = number(value, unit);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Counts with thousands separators, bytes in KiB, three digits.
fn number(value: f64, unit: &str) -> String {
    if unit == "instructions" {
        return group(value as u64);
    }
    let value = if unit == "bytes" { value / 1024.0 } else { value };
    let size = value.abs();
    let decimals = if size >= 99.95 {
        0
    } else if size >= 9.995 {
        1
    } else {
        2
    };
    format!("{value:.decimals$}")
}
