//! What the compiler tells its user about the spec file or a record.

use std::ops::Range;

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

/// One finding: what is wrong, where, and how to mend it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// How bad.
    pub severity: Severity,
    /// Stable code such as `E0102`, documented in `docs/diagnostics.md`.
    pub code: &'static str,
    /// Key path such as `actuator.voltage[1]`, empty if no key is to blame.
    pub key: String,
    /// Where.
    pub place: Place,
    /// What is wrong, with the value found and what was expected.
    pub message: String,
    /// How to mend it.
    pub help: String,
}
