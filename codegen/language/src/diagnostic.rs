//! Findings: messages to the user about the spec file or a record.

pub mod codes;
mod json;
mod position;
mod render;

use std::collections::BTreeMap;
use std::ops::Range;

pub use codes::Code;
pub use json::to_json;
pub use render::render;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// For information; nothing is refused.
    Note,
    /// A probable mistake; nothing is refused.
    Warning,
    /// An error: nothing is generated.
    Error,
}

/// Place of a finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Byte range in the spec file.
    Spec(Range<usize>),
    /// A line (counted from 1) of a data file named in the spec, or the whole file.
    File {
        /// Path as in the spec.
        path: String,
        /// Line, counted from 1, if the finding is about one line.
        line: Option<usize>,
    },
    /// The run as a whole (a missing file, an output folder).
    Whole,
}

/// A finding: the problem, its place, and how to fix it. Only the functions below create one, each from a [`Code`] of
/// the table.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diagnostic {
    /// Severity of its code.
    pub severity: Severity,
    /// Stable code such as `E0102`, documented in `docs/diagnostics.md`.
    pub code: &'static str,
    /// Key path such as `actuator.voltage[1]`; empty if the finding is not about a key.
    pub key: String,
    /// Where it is.
    pub place: Place,
    /// The problem, with the value found and what was expected.
    pub message: String,
    /// How to fix it.
    pub help: String,
    /// Replacement for the text at `place`, if the fix is that simple.
    pub replacement: Option<String>,
}

impl Diagnostic {
    /// A finding with the severity of `code`, about `key` (empty: about no key), at `place`.
    pub fn new(code: Code, key: &str, place: Place, message: impl Into<String>, help: impl Into<String>) -> Self {
        let (message, help) = (message.into(), help.into());
        Self { severity: code.severity(), code: code.id, key: key.to_owned(), place, message, help, replacement: None }
    }

    /// A finding at the first of `keys` that is in the spec, by its `spans`. If none is, it is about the whole spec,
    /// with the first key.
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

    /// A finding about no key, in the data file `path` as the user named it: at `line`, counted from 1, or about the
    /// whole file.
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
