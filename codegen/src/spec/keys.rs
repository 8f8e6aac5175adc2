//! The key table: every section and key of a spec, its kind, range, default and meaning.
//!
//! Reading, messages, the JSON Schema and `docs/spec-reference.md` all come from here; a key that is not here
//! does not exist. The rows are in `table`.

mod table;

use super::quantity::Dimension;

pub use table::SECTIONS;

/// The version of the language that `schema = …` names.
pub const SCHEMA_VERSION: i64 = 1;

/// A table of the file.
#[derive(Debug)]
pub struct Section {
    /// Path such as `target.budget`; empty for the keys before the first table.
    pub name: &'static str,
    /// May be left out as a whole although keys in it are required.
    pub optional: bool,
    /// One line for the reference.
    pub doc: &'static str,
    /// Its keys, in the order of the reference.
    pub keys: &'static [Key],
}

/// One key.
#[derive(Debug)]
pub struct Key {
    /// Name within the section.
    pub name: &'static str,
    /// What may stand there.
    pub shape: Shape,
    /// What happens if it is left out.
    pub presence: Presence,
    /// One line for the reference.
    pub doc: &'static str,
    /// Symbol of the paper, empty if it has none.
    pub symbol: &'static str,
    /// A TOML literal that is right.
    pub example: &'static str,
}

/// One value or several.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// A single value.
    One(Item),
    /// An array with exactly these items.
    List(&'static [Item]),
    /// An array of one or six file names, relative to the spec.
    Records,
}

/// A single value.
#[derive(Debug, Clone, Copy)]
pub enum Item {
    /// A string with number and unit.
    Quantity {
        /// What it measures.
        dimension: Dimension,
        /// Bounds in SI.
        range: Range,
        /// Unit in which messages speak of it.
        unit: &'static str,
    },
    /// A number without dimension.
    Number(Range),
    /// A whole number, bounds inclusive.
    Integer(i64, i64),
    /// One of these strings.
    Choice(&'static [&'static str]),
    /// A name: ASCII letter first, then letters, digits, `-` and `_`, at most [`MAX_NAME`] characters.
    Name,
}

/// Longest name of a platform.
pub const MAX_NAME: usize = 64;

/// Bounds on a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Whether `min` itself is allowed.
    pub min_included: bool,
    /// Whether `max` itself is allowed.
    pub max_included: bool,
}

impl Range {
    /// Both bounds allowed.
    #[must_use]
    pub const fn closed(min: f64, max: f64) -> Self {
        Self { min, max, min_included: true, max_included: true }
    }

    /// More than `min`, up to `max`.
    #[must_use]
    pub const fn above(min: f64, max: f64) -> Self {
        Self { min, max, min_included: false, max_included: true }
    }

    /// Neither bound allowed.
    #[must_use]
    pub const fn open(min: f64, max: f64) -> Self {
        Self { min, max, min_included: false, max_included: false }
    }

    /// Whether `value` lies inside.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        let above = value > self.min || (self.min_included && value >= self.min);
        let below = value < self.max || (self.max_included && value <= self.max);
        above && below
    }
}

/// What happens if a key is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presence {
    /// It must be there (in an optional section: if the section is there).
    Required,
    /// This TOML literal takes its place.
    Default(&'static str),
    /// Nothing takes its place.
    Optional,
    /// Instead of another key, which must not stand beside it; whether one is needed depends on the mode.
    InsteadOf(&'static str),
}

impl Section {
    /// Whether a file without this table is refused.
    #[must_use]
    pub fn is_required(&self) -> bool {
        !self.optional && self.keys.iter().any(|key| key.presence == Presence::Required)
    }

    /// Key path of one of its keys: `geometry.height`, or `name` before the first table.
    #[must_use]
    pub fn path(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// The section as it may be written, from the examples of its keys.
    #[must_use]
    pub fn example(&self, required_only: bool) -> String {
        let mut text = if self.name.is_empty() { String::new() } else { format!("[{}]\n", self.name) };
        for key in self.keys.iter().filter(|key| !required_only || key.presence == Presence::Required) {
            text.push_str(&format!("{} = {}\n", key.name, key.example));
        }
        text
    }
}

/// The section called `name`.
#[must_use]
pub fn section(name: &str) -> Option<&'static Section> {
    SECTIONS.iter().find(|section| section.name == name)
}

/// The key at `path` (`geometry.height`).
#[must_use]
pub fn key(path: &str) -> Option<&'static Key> {
    let (section_name, key_name) = path.rsplit_once('.').unwrap_or(("", path));
    section(section_name)?.keys.iter().find(|key| key.name == key_name)
}
