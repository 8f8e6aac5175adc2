//! Whether this computer can run a controller in real time, and what to change where it cannot.
//!
//! [`system`] and [`equipment`] look at files under a root, so that tests can show them any computer; [`latency`] measures this one.

pub mod equipment;
pub mod latency;
mod report;
pub mod system;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use report::{Report, Verdict, examine};

/// How a finding bears on real time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// As it should be.
    Good,
    /// Cannot be seen from here: a container, a virtual machine, a missing right.
    Unknown,
    /// Costs latency, or something optional is missing.
    Warning,
    /// In the way.
    Bad,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub subject: &'static str,
    /// How it is.
    pub grade: Grade,
    /// What was found.
    pub found: String,
    /// What to change; none where nothing is to be.
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
    /// Those of this computer.
    #[must_use]
    pub fn of_this_computer() -> Self {
        Self::below(Path::new("/"))
    }

    /// Those below a folder.
    #[must_use]
    pub fn below(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// Text of a file without the blanks around it; none if it cannot be read.
    fn text(&self, path: &str) -> Option<String> {
        std::fs::read_to_string(self.path(path)).ok().map(|text| text.trim().to_owned())
    }

    /// Names in a folder that begin so, in order.
    fn names(&self, folder: &str, beginning: &str) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(self.path(folder)) else { return Vec::new() };
        let names = entries.filter_map(Result::ok).map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| name.starts_with(beginning)).collect();
        names.sort();
        names
    }
}
