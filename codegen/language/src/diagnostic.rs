//! What the compiler tells its user about the spec file or a record.

pub mod codes;
mod json;
mod position;
mod render;

use std::collections::BTreeMap;
use std::ops::Range;

pub use codes::Code;
pub use json::to_json;
pub use render::render;

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; nothing is refused.
    Note,
    /// Probably wrong; nothing is refused.
    Warning,
    /// Refused: nothing is generated.
    Error,
}

/// Where a finding is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Byte range in the spec file.
    Spec(Range<usize>),
    /// A line (counted from 1) of a data file named in the spec, or the whole file.
    File {
        /// Path as the spec names it.
        path: String,
        /// Line, counted from 1, if one line is to blame.
        line: Option<usize>,
    },
    /// The run as a whole (a missing file, an output folder).
    Whole,
}

/// One finding: what is wrong, where, and how to fix it. Only the functions below make one, each from a [`Code`] of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diagnostic {
    /// How bad it is, as its code says.
    pub severity: Severity,
    /// Stable code such as `E0102`, documented in `docs/diagnostics.md`.
    pub code: &'static str,
    /// Key path such as `actuator.voltage[1]`, empty if no key is to blame.
    pub key: String,
    /// Where it is.
    pub place: Place,
    /// What is wrong, with the value found and what was expected.
    pub message: String,
    /// How to fix it.
    pub help: String,
    /// Text that may stand at `place` instead, where the fix is as simple as that.
    pub replacement: Option<String>,
}

impl Diagnostic {
    /// A finding as bad as its `code`, about `key` (empty: about no key), at `place`.
    #[must_use]
    pub fn new(code: Code, key: &str, place: Place, message: impl Into<String>, help: impl Into<String>) -> Self {
        let (message, help) = (message.into(), help.into());
        Self { severity: code.severity(), code: code.id, key: key.to_owned(), place, message, help, replacement: None }
    }

    /// A finding at the first of `keys` that stands in the spec, by its `spans`; at none of them, about the whole spec
    /// and under the first.
    #[must_use]
    pub fn at(
        spans: &BTreeMap<String, Range<usize>>,
        keys: &[&str],
        code: Code,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        let found = keys.iter().find_map(|key| spans.get(*key).map(|span| (*key, Place::Spec(span.clone()))));
        let (key, place) = found.unwrap_or_else(|| (keys.first().copied().unwrap_or_default(), Place::Whole));
        Self::new(code, key, place, message, help)
    }

    /// A finding about no key, in the data file `path` as its user knows it: at `line`, counted from 1, or about the whole.
    #[must_use]
    pub fn in_file(
        path: &str,
        line: Option<usize>,
        code: Code,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self::new(code, "", Place::File { path: path.to_owned(), line }, message, help)
    }
}
