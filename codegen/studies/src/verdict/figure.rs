//! A number about a platform, how it stands to its limit, and how it is written.

use host_sim::coverage::Coverage;
use serde::Serialize;
use specgen_toolchain::budget::group;

/// What a figure is about: a line of the text, a row of a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subject {
    /// How far each axis goes alone, from the middle of the strokes, µm and µrad; the limit is the declared workspace.
    Reach,
    /// Noise of the pose at rest, as the gauges show it, and of a reading, rms; `step`: the finest of the converters, at a leg or the platform.
    Noise,
    /// How well the hysteresis tables fit their records.
    Record,
    /// How far the worst control mode is from instability.
    Margins,
    /// Errors along trajectories of the spec. [`Verdict::of`](super::Verdict::of) has none, but says that there are limits: a run has
    /// to be made.
    Tracking,
    /// Instructions of a tick.
    Time,
    /// Flash, RAM and stack; what the image must not do.
    Memory,
    /// Whether host and microcontroller compute the same bits.
    Bits,
}

impl Subject {
    /// In the order in which they are said.
    pub const ALL: [Self; 8] =
        [Self::Reach, Self::Noise, Self::Record, Self::Margins, Self::Tracking, Self::Time, Self::Memory, Self::Bits];

    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reach => "reach",
            Self::Noise => "noise",
            Self::Record => "record",
            Self::Margins => "margins",
            Self::Tracking => "tracking",
            Self::Time => "time",
            Self::Memory => "memory",
            Self::Bits => "bits",
        }
    }
}

/// How a figure stands to its limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// It keeps it.
    Within,
    /// It does not: the platform is not ready.
    Beyond,
    /// There is none: the figure is not judged.
    NoLimit,
}

/// What a figure may be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// In the unit of the figure.
    pub value: f64,
    /// Whether the figure must be at least this; else at most.
    pub least: bool,
    /// Who says so: a key of the spec, or the part.
    pub from: String,
}

/// A number about the platform, and its limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is about.
    pub subject: Subject,
    /// Which one of these, such as `z` or `flash`.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// Whether it is more than `value`: nothing beyond was looked at.
    pub more: bool,
    /// Of value and limit; empty for ratios.
    pub unit: &'static str,
    /// If the spec or the part has one.
    pub limit: Option<Limit>,
    /// How it stands to that.
    pub mark: Mark,
    /// Said in place of the number, where it is no measure.
    pub words: Option<String>,
    /// What was measured; none where nothing follows a path.
    #[serde(flatten)]
    pub coverage: Option<Coverage>,
}

impl Figure {
    /// A figure that is not judged.
    #[must_use]
    pub fn new(subject: Subject, name: &str, value: f64, unit: &'static str) -> Self {
        let name = name.to_owned();
        Self { subject, name, value, more: false, unit, limit: None, mark: Mark::NoLimit, words: None, coverage: None }
    }

    /// A fact in words that is as it must be, or not.
    #[must_use]
    pub fn fact(subject: Subject, name: &str, words: String, good: bool) -> Self {
        let mark = if good { Mark::Within } else { Mark::Beyond };
        Self { mark, words: Some(words), ..Self::new(subject, name, 0.0, "") }
    }

    /// A figure of which only this is known: it is more.
    #[must_use]
    pub fn more_than(subject: Subject, name: &str, value: f64, unit: &'static str) -> Self {
        Self { more: true, ..Self::new(subject, name, value, unit) }
    }

    /// The same, measured over this part of a path.
    #[must_use]
    pub fn over(self, coverage: Coverage) -> Self {
        Self { coverage: Some(coverage), ..self }
    }

    /// The same, which must be at most `value` by what `from` says.
    #[must_use]
    pub fn at_most(self, value: f64, from: &str) -> Self {
        let mark = if self.value <= value && !self.more { Mark::Within } else { Mark::Beyond };
        Self { mark, limit: Some(Limit { value, least: false, from: from.to_owned() }), ..self }
    }

    /// The same, which must be at least `value` by what `from` says.
    #[must_use]
    pub fn at_least(self, value: f64, from: &str) -> Self {
        let mark = if self.value >= value { Mark::Within } else { Mark::Beyond };
        Self { mark, limit: Some(Limit { value, least: true, from: from.to_owned() }), ..self }
    }

    /// The value without its unit, in KiB where that is bytes; `> 5` where it is more.
    #[must_use]
    pub fn value_text(&self) -> String {
        if self.more { format!("> {}", plain(self.value, self.unit)) } else { number(self.value, self.unit) }
    }

    /// How value and limit stand to each other: `≤`, `>`, `≥` or `<`; none without a limit.
    #[must_use]
    pub fn relation(&self) -> Option<&'static str> {
        let limit = self.limit.as_ref()?;
        Some(match (limit.least, self.mark) {
            (false, Mark::Beyond) => ">",
            (false, _) => "≤",
            (true, Mark::Beyond) => "<",
            (true, _) => "≥",
        })
    }

    /// The limit without its unit, as the value; empty without one.
    #[must_use]
    pub fn limit_text(&self) -> String {
        self.limit.as_ref().map_or_else(String::new, |limit| plain(limit.value, self.unit))
    }
}

/// A number that was chosen has few decimals.
fn plain(value: f64, unit: &str) -> String {
    let text = number(value, unit);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Counts with their thousands, bytes in KiB, three digits.
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
