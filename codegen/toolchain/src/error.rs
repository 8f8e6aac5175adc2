//! Errors between an emitted workspace and its measured figures.

use std::fmt;
use std::path::PathBuf;

use specgen_language::outcome::Failure;

/// A failure of a tool, a build or the emulator, with advice.
#[derive(Debug)]
#[non_exhaustive]
pub enum TargetError {
    /// A tool is not installed. Exit code class "environment".
    MissingTool {
        /// The tool.
        tool: String,
        /// Where it was searched.
        looked: String,
        /// The command that installs it.
        command: String,
    },
    /// A tool could not be installed.
    SetUpFailed {
        /// The tool.
        tool: String,
        /// Each method that was tried, and why it failed.
        tried: Vec<String>,
        /// How to install it manually.
        command: String,
    },
    /// A tool exists but does not work on this machine.
    BrokenTool {
        /// The tool.
        tool: String,
        /// The useful part of what it printed.
        text: String,
    },
    /// This program is linked statically and cannot load a library, so it cannot run the built controller.
    Static,
    /// The compiler or the linker refused the emitted workspace.
    BuildFailed {
        /// What was being built.
        what: String,
        /// The useful part of what the tool printed.
        text: String,
    },
    /// The image links only if nothing can panic, and something can.
    PanicPath {
        /// What was being built.
        what: String,
        /// The panic sites, one per line, if they could be found; else the linker's output.
        text: String,
    },
    /// The emulator ended without a result.
    EmulatorFailed {
        /// What it reported.
        text: String,
    },
    /// The emulator was stopped at the time limit.
    EmulatorTimeout {
        /// The limit, s.
        seconds: u64,
    },
    /// The output files of the replay do not have the expected layout.
    MalformedStats {
        /// Actual and expected.
        text: String,
    },
    /// The inputs of a replay are inconsistent.
    BadRequest {
        /// Actual and expected.
        text: String,
    },
    /// The image is not what the analysis expects.
    MalformedImage {
        /// Actual and expected.
        text: String,
    },
    /// A file or folder cannot be read or written.
    Io {
        /// The operation.
        doing: String,
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
}

impl TargetError {
    /// True if the machine is at fault, false if the emitted workspace is (exit codes 3 and 1).
    #[must_use]
    pub fn is_environment(&self) -> bool {
        self.is_of_a_tool() || matches!(self, Self::Io { .. })
    }

    /// True if an optional tool is missing or broken: steps that need it can be skipped.
    #[must_use]
    pub fn is_of_a_tool(&self) -> bool {
        matches!(self, Self::MissingTool { .. } | Self::SetUpFailed { .. } | Self::BrokenTool { .. } | Self::Static)
    }

    /// A failure of the operating system while `doing` something with `path`.
    pub fn io(doing: &str, path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Self::Io { doing: doing.to_owned(), path: path.into(), source }
    }
}

impl fmt::Display for TargetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MissingTool { tool, looked, command } => {
                write!(f, "{tool} is not installed (searched for {looked}); install it with: {command}")
            }
            Self::SetUpFailed { tool, tried, command } => {
                write!(f, "{tool} could not be set up: {}; install it manually: {command}", tried.join("; "))
            }
            Self::BrokenTool { tool, text } => write!(f, "{tool} does not work on this machine: {text}"),
            Self::Static => f.write_str(
                "this specgen is linked statically and cannot load the controller that it builds; use the release \
                 for glibc (specgen-VERSION-x86_64-unknown-linux-gnu.tar.gz), or build it from source: \
                 cargo install --path codegen/cli --locked",
            ),
            Self::BuildFailed { what, text } => write!(f, "building {what} failed:\n{text}"),
            Self::PanicPath { what, text } => write!(
                f,
                "{what} can panic: a panic path remains after optimisation, so linking failed.\n\
                 Look for an unchecked index, an integer division by a run-time value, a slice range, \
                 or an unwrap in the controller or the runtime.\n{text}"
            ),
            Self::EmulatorFailed { text } => {
                write!(f, "the emulator ended without a result: {text}")
            }
            Self::EmulatorTimeout { seconds } => {
                write!(f, "the emulator was stopped after {seconds} s; replay fewer ticks or increase the time limit")
            }
            Self::MalformedStats { text } => {
                write!(f, "the replay's result cannot be used: {text}")
            }
            Self::BadRequest { text } => write!(f, "invalid replay input: {text}"),
            Self::MalformedImage { text } => write!(f, "the image cannot be analysed: {text}"),
            Self::Io { doing, path, source } => write!(f, "{doing} {}: {source}", path.display()),
        }
    }
}

impl std::error::Error for TargetError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

impl From<TargetError> for Failure {
    fn from(error: TargetError) -> Self {
        Self::Tool { message: error.to_string(), is_missing: error.is_of_a_tool() }
    }
}
