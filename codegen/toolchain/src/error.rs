//! Errors between an emitted workspace and its measured figures.

use std::path::PathBuf;

use specgen_language::outcome::Failure;

/// A failure of a tool, a build or the emulator, with advice.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// A tool is not installed. Exit code class "environment".
    #[error("{tool} is not installed (searched for {looked}); install it with: {command}")]
    MissingTool {
        /// The tool.
        tool: String,
        /// Where it was searched.
        looked: String,
        /// The command that installs it.
        command: String,
    },
    /// A tool could not be installed.
    #[error("{tool} could not be set up: {}; install it manually: {command}", tried.join("; "))]
    SetUpFailed {
        /// The tool.
        tool: String,
        /// Each method that was tried, and why it failed.
        tried: Vec<String>,
        /// How to install it manually.
        command: String,
    },
    /// A tool exists but does not work on this machine.
    #[error("{tool} does not work on this machine: {text}")]
    BrokenTool {
        /// The tool.
        tool: String,
        /// The useful part of what it printed.
        text: String,
    },
    /// This program is linked statically and cannot load a library, so it cannot run the built controller.
    #[error(
        "this specgen is linked statically and cannot load the controller that it builds; use the release \
         for glibc (specgen-VERSION-x86_64-unknown-linux-gnu.tar.gz), or build it from source: \
         cargo install --path codegen/cli --locked"
    )]
    Static,
    /// The compiler or the linker refused the emitted workspace.
    #[error("building {what} failed:\n{text}")]
    BuildFailed {
        /// What was being built.
        what: String,
        /// The useful part of what the tool printed.
        text: String,
    },
    /// The image links only if nothing can panic, and something can.
    #[error(
        "{what} can panic: a panic path remains after optimisation, so linking failed.\n\
         Look for an unchecked index, an integer division by a run-time value, a slice range, \
         or an unwrap in the controller or the runtime.\n{text}"
    )]
    PanicPath {
        /// What was being built.
        what: String,
        /// The panic sites, one per line, if they could be found; else the linker's output.
        text: String,
    },
    /// The emulator ended without a result.
    #[error("the emulator ended without a result: {text}")]
    EmulatorFailed {
        /// What it reported.
        text: String,
    },
    /// The emulator was stopped at the time limit.
    #[error("the emulator was stopped after {seconds} s; replay fewer ticks or increase the time limit")]
    EmulatorTimeout {
        /// The limit, s.
        seconds: u64,
    },
    /// The output files of the replay do not have the expected layout.
    #[error("the replay's result cannot be used: {text}")]
    MalformedStats {
        /// Actual and expected.
        text: String,
    },
    /// The inputs of a replay are inconsistent.
    #[error("invalid replay input: {text}")]
    BadRequest {
        /// Actual and expected.
        text: String,
    },
    /// The image is not what the analysis expects.
    #[error("the image cannot be analysed: {text}")]
    MalformedImage {
        /// Actual and expected.
        text: String,
    },
    /// A file or folder cannot be read or written.
    #[error("{doing} {}: {source}", path.display())]
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
    /// True if an optional tool is missing or broken: steps that need it can be skipped.
    pub fn is_of_a_tool(&self) -> bool {
        matches!(self, Self::MissingTool { .. } | Self::SetUpFailed { .. } | Self::BrokenTool { .. } | Self::Static)
    }

    /// The image is not what the analysis expects.
    pub(crate) fn malformed(error: impl std::fmt::Display) -> Self {
        Self::MalformedImage { text: error.to_string() }
    }

    /// A failure of the operating system while `doing` something with `path`.
    pub fn io(doing: &str, path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Self::Io { doing: doing.to_owned(), path: path.into(), source }
    }
}

impl From<TargetError> for Failure {
    fn from(error: TargetError) -> Self {
        Self::Tool { message: error.to_string(), is_missing: error.is_of_a_tool() }
    }
}
