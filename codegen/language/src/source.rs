//! The text that findings point into.

use std::path::PathBuf;

/// Text of a spec, and where it came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpecSource {
    /// Path as messages show it.
    pub display_name: String,
    /// The whole text, without byte-order mark. Spans count its bytes.
    pub text: String,
    /// Folder that file names in the spec are relative to.
    pub dir: PathBuf,
}
