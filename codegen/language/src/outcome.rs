//! Results and failures that every command has in common.

use std::fmt::Display;

use serde::Serialize;
use serde_json::Value;

use crate::diagnostic::{Diagnostic, Place, Severity};
use crate::source::SpecSource;

/// Exit code where the computer is to blame: a tool, a disk.
pub(crate) const ENVIRONMENT: u8 = 3;
/// Exit code of a simulated run that did not reach the end of its path.
pub(crate) const ENDED_EARLY: u8 = 4;
/// Exit code of a command that Ctrl-C ended, as in shells.
const INTERRUPTED: u8 = 130;

/// The result of a command: text for people, its fields for the JSON document.
pub trait Outcome: Serialize {
    /// The text, whole lines; none if it has only fields, or its text was printed earlier.
    fn text(&self) -> String {
        String::new()
    }
}

/// JSON is its own text.
impl Outcome for Value {
    fn text(&self) -> String {
        format!("{self:#}\n")
    }
}

/// A spec or a record that was refused: at least one finding is an error.
#[derive(Debug)]
pub struct Refusal {
    /// The file, if it could be read.
    pub source: Option<SpecSource>,
    /// All findings of the run.
    pub findings: Vec<Diagnostic>,
}

impl Refusal {
    /// The file that is to blame, as its user named it. A spec that names a bad record is refused itself.
    fn file(&self) -> &str {
        if let Some(source) = &self.source {
            return &source.display_name;
        }
        let first = self.findings.iter().find(|finding| finding.severity == Severity::Error);
        match first.map(|finding| &finding.place) {
            Some(Place::File { path, .. }) => path,
            _ => "the input",
        }
    }
}

/// Reasons why a command fails, by exit code.
#[derive(Debug)]
pub enum Failure {
    /// The spec or a record is refused.
    Refused(Box<Refusal>),
    /// A declared budget is exceeded, a comparison failed: exit code 1.
    Gate(String),
    /// Arguments that make no sense together.
    Usage(String),
    /// A tool is missing or failed.
    Tool {
        /// The reason.
        message: String,
        /// The tool is missing or broken: a command can skip what needs it.
        is_missing: bool,
    },
    /// The file system or the simulator reported an error.
    Environment(String),
    /// A gate is not passed, with the figures that show it: exit code 1.
    Judged {
        /// The reason.
        message: String,
        /// For programs; the text is printed already.
        result: Value,
    },
    /// A part of the work is done, and the computer cannot do the rest: exit code 3.
    Incomplete {
        /// The reason.
        message: String,
        /// For programs; the text is printed already.
        result: Value,
    },
    /// A run did not reach the end of its path, so that it has no figure: exit code 4, with the figures of the others.
    EndedEarly {
        /// The reason.
        message: String,
        /// For programs; the text is printed already.
        result: Value,
    },
    /// Ended by Ctrl-C, with the result so far.
    Interrupted {
        /// The reason.
        message: String,
        /// For programs; the text is printed already.
        result: Value,
    },
}

impl Failure {
    /// Ended by Ctrl-C before there was a result.
    pub fn interrupted() -> Self {
        let message = "interrupted: there is no result and no partial file".to_owned();
        Self::Interrupted { message, result: Value::Null }
    }

    /// The exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Refused(_) | Self::Gate(_) | Self::Judged { .. } => 1,
            Self::Usage(_) => 2,
            Self::Tool { .. } | Self::Environment(_) | Self::Incomplete { .. } => ENVIRONMENT,
            Self::EndedEarly { .. } => ENDED_EARLY,
            Self::Interrupted { .. } => INTERRUPTED,
        }
    }

    /// The reason, as the last line of the command.
    pub fn message(&self) -> String {
        match self {
            Self::Refused(refused) => format!("{} is refused; nothing was written", refused.file()),
            Self::Gate(message)
            | Self::Usage(message)
            | Self::Environment(message)
            | Self::Tool { message, .. }
            | Self::Judged { message, .. }
            | Self::Incomplete { message, .. }
            | Self::EndedEarly { message, .. }
            | Self::Interrupted { message, .. } => message.clone(),
        }
    }

    /// The part of the result that there is; null if there is none.
    pub fn result(&self) -> Value {
        match self {
            Self::Interrupted { result, .. }
            | Self::Judged { result, .. }
            | Self::EndedEarly { result, .. }
            | Self::Incomplete { result, .. } => result.clone(),
            _ => Value::Null,
        }
    }
}

/// The file system or the simulator reported an error.
pub fn environment(error: impl Display) -> Failure {
    Failure::Environment(error.to_string())
}

impl From<Refusal> for Failure {
    fn from(refused: Refusal) -> Self {
        Self::Refused(Box::new(refused))
    }
}
