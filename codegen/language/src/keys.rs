//! Declarations of a spec's sections and keys: kind, range, default and meaning of each key, and the field that it
//! fills.
//!
//! The declarations are in [`crate::model`]. Reading, messages, the JSON Schema and `docs/spec-reference.md` follow
//! from them.

pub(crate) mod declare;
pub(crate) mod fields;

use crate::quantity::Dimension;

/// The version of the language that `schema = …` names.
pub const SCHEMA_VERSION: i64 = 1;

/// A table of the file.
#[derive(Debug)]
pub struct Section {
    /// Path such as `target.budget`; empty for the keys before the first table.
    pub name: &'static str,
    /// How often it may occur in a file.
    pub kind: Kind,
    /// Other names; messages lead from them to the section.
    pub aliases: &'static [&'static str],
    /// One line for the reference.
    pub doc: &'static str,
    /// Its keys, in the order of the reference.
    pub keys: &'static [Key],
}

/// How often a section may occur in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Once; optional if it has no required key.
    Plain,
    /// Once, or left out as a whole although some of its keys are required.
    Optional,
    /// At least and at most this many times, with double brackets: `[[gauge]]`. Checks count them.
    Repeated(usize, usize),
}

/// Most tables of a repeated section that are read.
pub const MAX_TABLES: usize = 32;

/// One key.
#[derive(Debug)]
pub struct Key {
    /// Name within the section.
    pub name: &'static str,
    /// Form of its value.
    pub shape: Shape,
    /// What happens if it is left out.
    pub presence: Presence,
    /// One line for the reference.
    pub doc: &'static str,
    /// Symbol of the paper, empty if it has none.
    pub symbol: &'static str,
    /// Other names. They are not accepted, nor is the symbol; messages lead from them to the key.
    pub aliases: &'static [&'static str],
    /// A TOML literal that is valid for some platform: for the reference, the schema and tests. It is not a fix;
    /// messages show [`Key::template`].
    pub example: &'static str,
}

/// One value or several.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// A single value.
    One(Item),
    /// An array with exactly these items.
    List(&'static [Item]),
    /// An array of this many arrays, each with exactly these items.
    Rows(usize, &'static [Item]),
    /// An array with at least this many of these items, from the first one on.
    Leading(usize, &'static [Item]),
    /// An array of one or six file names, relative to the spec.
    Records,
    /// An array of texts `KEY: REASON`, each about a key of the spec.
    Reasons,
    /// An array of texts, each the path of a key of the spec.
    Paths,
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
        /// Unit that messages use.
        unit: &'static str,
    },
    /// A number without dimension.
    Number(Range),
    /// A whole number, both bounds included.
    Integer(i64, i64),
    /// One of these strings.
    Choice(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
    /// A file name relative to the spec.
    File,
    /// A reason: at least two words.
    Reason,
    /// A description of the columns of a file, as the option `--columns` takes it.
    Columns,
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
    pub const fn closed(min: f64, max: f64) -> Self {
        Self { min, max, min_included: true, max_included: true }
    }

    /// Above `min`, up to `max`.
    pub const fn above(min: f64, max: f64) -> Self {
        Self { min, max, min_included: false, max_included: true }
    }

    /// Neither bound allowed.
    pub const fn open(min: f64, max: f64) -> Self {
        Self { min, max, min_included: false, max_included: false }
    }

    /// Whether `value` lies inside.
    pub fn contains(&self, value: f64) -> bool {
        let above = value > self.min || (self.min_included && value >= self.min);
        let below = value < self.max || (self.max_included && value <= self.max);
        above && below
    }
}

/// What happens if a key is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presence {
    /// It is required (in an optional section: if the section is there).
    Required,
    /// This TOML literal is used.
    Default(&'static str),
    /// It stays empty.
    Optional,
    /// It is an alternative to another key, which excludes it; whether one is needed depends on the mode.
    InsteadOf(&'static str),
    /// It belongs to the forms of these names: the section has all keys of exactly one form.
    Form(&'static [&'static str]),
    /// This rule, which a check or the building of the model implements.
    Rule(&'static str),
}

impl Presence {
    /// The forms that a key belongs to; none if it is not one of several.
    pub const fn forms(self) -> &'static [&'static str] {
        if let Self::Form(forms) = self { forms } else { &[] }
    }
}

impl Item {
    /// A TOML literal of its form, with a placeholder for the value and with its unit: `"<number> kg"`. A value is
    /// written out only if it is the only valid one.
    pub fn template(self) -> String {
        match self {
            Self::Quantity { unit, .. } => format!("\"<number> {unit}\""),
            Self::Integer(only, last) if only == last => only.to_string(),
            Self::Number(_) | Self::Integer(..) => "<number>".to_owned(),
            Self::Choice(_) => "\"<word>\"".to_owned(),
            Self::Flag => "<true or false>".to_owned(),
            Self::File => "\"<file>\"".to_owned(),
            Self::Name => "\"<name>\"".to_owned(),
            Self::Reason => "\"<reason>\"".to_owned(),
            Self::Columns => "\"<columns>\"".to_owned(),
        }
    }
}

/// The placeholder in a text, with its angle brackets: letters and blanks between `<` and `>`.
pub fn placeholder(text: &str) -> Option<&str> {
    let start = text.find('<')?;
    let end = start + text[start..].find('>')?;
    let inner = &text[start + 1..end];
    let words = !inner.is_empty() && inner.chars().all(|c| c.is_ascii_alphabetic() || c == ' ');
    words.then(|| &text[start..=end])
}

impl Key {
    /// A TOML literal of its form, with a placeholder for each value: `["<number> V", "<number> V"]`. For a list, its
    /// least number of values.
    pub fn template(&self) -> String {
        let list = |items: &[Item]| {
            let items: Vec<String> = items.iter().map(|item| item.template()).collect();
            format!("[{}]", items.join(", "))
        };
        match self.shape {
            Shape::One(item) => item.template(),
            Shape::List(items) => list(items),
            Shape::Leading(least, items) => list(&items[..least]),
            Shape::Rows(count, items) => format!("[{}]", vec![list(items); count].join(", ")),
            Shape::Records => list(&[Item::File]),
            Shape::Reasons => "[\"<key>: <reason>\"]".to_owned(),
            Shape::Paths => "[\"<key>\"]".to_owned(),
        }
    }

    /// The item that `path` names: this key, or one value of its list ("gains.integral\[3\]").
    pub fn item(&self, path: &str) -> Option<Item> {
        match self.shape {
            Shape::One(item) => Some(item),
            Shape::List(items) | Shape::Rows(_, items) | Shape::Leading(_, items) => {
                let index =
                    path.rsplit_once('[').and_then(|(_, rest)| rest.trim_end_matches(']').parse::<usize>().ok());
                items.get(index.unwrap_or(0)).copied()
            }
            Shape::Records | Shape::Reasons | Shape::Paths => None,
        }
    }

    /// The template of the key, or of the one item that `path` names.
    pub fn form(&self, path: &str) -> String {
        let is_item = path.ends_with(']') || matches!(self.shape, Shape::One(_));
        self.item(path).filter(|_| is_item).map_or_else(|| self.template(), Item::template)
    }

    /// A line of a spec with this key: name and [`Key::template`].
    pub fn line(&self) -> String {
        match self.shape {
            Shape::One(Item::Flag) => format!("{0} = true or {0} = false", self.name),
            _ => format!("{} = {}", self.name, self.template()),
        }
    }

    /// Whether `name` is its symbol or an alias, regardless of case and word separators.
    pub fn is_called(&self, name: &str) -> bool {
        // "I_xx I_yy I_zz" are the three symbols of one list.
        self.symbol.split(' ').chain(self.aliases.iter().copied()).any(|other| is_same(other, name))
    }
}

impl Section {
    /// The same of the section.
    pub fn is_called(&self, name: &str) -> bool {
        self.aliases.iter().any(|other| is_same(other, name))
    }

    /// Whether a file without this table is refused.
    pub fn is_required(&self) -> bool {
        let needed = |key: &Key| matches!(key.presence, Presence::Required | Presence::Form(_));
        self.kind == Kind::Plain && self.keys.iter().any(needed)
    }

    /// Key path of one of its keys: `geometry.height`, or `name` before the first table.
    pub fn path(&self, key: &str) -> String {
        join(self.name, key)
    }

    /// Its header, `[name]` or `[[name]]`; empty before the first section.
    pub fn header(&self) -> String {
        match self.kind {
            _ if self.name.is_empty() => String::new(),
            Kind::Repeated(..) => format!("[[{}]]", self.name),
            Kind::Plain | Kind::Optional => format!("[{}]", self.name),
        }
    }

    /// The forms of its keys ([`Presence::Form`]), in the order of the table.
    pub fn forms(&self) -> Vec<&'static str> {
        let mut forms = Vec::new();
        for form in self.keys.iter().flat_map(|key| key.presence.forms()) {
            if !forms.contains(form) {
                forms.push(*form);
            }
        }
        forms
    }

    /// Its header, and a line for each required key, with a placeholder for each value.
    pub fn template(&self) -> String {
        let mut text = self.header();
        if !text.is_empty() {
            text.push('\n');
        }
        let of_first = |key: &Key| self.forms().first().is_some_and(|form| key.presence.forms().contains(form));
        let needed = |key: &&Key| key.presence == Presence::Required || of_first(key);
        for key in self.keys.iter().filter(needed) {
            text.push_str(&format!("{}\n", key.line()));
        }
        text
    }
}

/// Whether two names are equal apart from case and word separators. The case of a single letter counts, as in `k` and
/// `K`.
fn is_same(a: &str, b: &str) -> bool {
    !a.is_empty() && (a == b || (a.len() > 1 && letters(a).eq(letters(b))))
}

fn letters(name: &str) -> impl Iterator<Item = u8> {
    name.bytes().filter(|byte| !matches!(byte, b'_' | b'-' | b' ')).map(|byte| byte.to_ascii_lowercase())
}

/// Key path of `key` in the table at `table`: `gauge[2].point`, or `name` before the first table.
pub fn join(table: &str, key: &str) -> String {
    if table.is_empty() { key.to_owned() } else { format!("{table}.{key}") }
}
