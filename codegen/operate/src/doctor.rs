//! Checks whether this computer can run a controller in real time, and suggests changes.
//!
//! [`system`] and [`equipment`] read files below a root, which tests can replace; [`latency`] measures this computer.

pub mod equipment;
pub mod latency;
mod report;
pub mod system;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use report::{Report, Verdict, examine};

/// Grade of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// No problem.
    Good,
    /// Not visible from here: a container, a virtual machine, a missing privilege.
    Unknown,
    /// Adds latency, or something optional is missing.
    Warning,
    /// Prevents real-time operation.
    Bad,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What was checked.
    pub subject: &'static str,
    /// The grade.
    pub grade: Grade,
    /// The result.
    pub found: String,
    /// What to change, if anything.
    pub fix: Option<String>,
}

impl Finding {
    fn good(subject: &'static str, found: impl Into<String>) -> Self {
        Self { subject, grade: Grade::Good, found: found.into(), fix: None }
    }

    fn of(subject: &'static str, grade: Grade, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { subject, grade, found: found.into(), fix: Some(fix.into()) }
    }
}

/// The files of a computer.
#[derive(Debug, Clone)]
pub struct Files {
    root: PathBuf,
}

impl Files {
    /// The files of this computer.
    #[must_use]
    pub fn of_this_computer() -> Self {
        Self::below(Path::new("/"))
    }

    /// The files below a folder.
    #[must_use]
    pub fn below(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// Trimmed text of a file; none if it cannot be read.
    fn text(&self, path: &str) -> Option<String> {
        std::fs::read_to_string(self.path(path)).ok().map(|text| text.trim().to_owned())
    }

    /// Sorted names in a folder with this prefix.
    fn names(&self, folder: &str, beginning: &str) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(self.path(folder)) else { return Vec::new() };
        let names = entries.filter_map(Result::ok).map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| name.starts_with(beginning)).collect();
        names.sort();
        names
    }
}
