//! What can go wrong between an emitted workspace and its measured figures.

use std::fmt;
use std::path::PathBuf;

use specgen_language::outcome::Failure;

/// A failure of a tool, of a build or of the emulator, with what to do about it.
#[derive(Debug)]
#[non_exhaustive]
pub enum TargetError {
    /// A tool is not installed. Exit code class "environment".
    MissingTool {
        /// What is missing.
        tool: String,
        /// Where it was looked for.
        looked: String,
        /// The command that installs it.
        command: String,
    },
    /// A tool could not be brought onto this machine.
    SetUpFailed {
        /// What is missing.
        tool: String,
        /// Each way that was tried, and where it ended.
        tried: Vec<String>,
        /// What is left to do by hand.
        command: String,
    },
    /// A tool is there and does not do its work on this machine.
    BrokenTool {
        /// Which.
        tool: String,
        /// The useful part of what it printed.
        text: String,
    },
    /// This program is linked statically and cannot load a library: what needs the built controller is left out.
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
        /// The places, one a line, where they could be found; else what the linker printed.
        text: String,
    },
    /// The emulator ended without a result.
    EmulatorFailed {
        /// What it did.
        text: String,
    },
    /// The emulator was still running after the time limit, and was ended.
    EmulatorTimeout {
        /// The limit, s.
        seconds: u64,
    },
    /// The replay's files do not hold what the firmware promises to write.
    MalformedStats {
        /// What was found and what was expected.
        text: String,
    },
    /// What the caller wants replayed does not fit together.
    BadRequest {
        /// What was found and what was expected.
        text: String,
    },
    /// The image is not what the analysis expects.
    MalformedImage {
        /// What was found and what was expected.
        text: String,
    },
    /// A file or folder cannot be read or written.
    Io {
        /// What was being done.
        doing: String,
        /// The file, or the folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl TargetError {
    /// True if the machine lacks something, false if the emitted workspace is to blame (exit codes 3 and 1).
    #[must_use]
    pub fn is_environment(&self) -> bool {
        self.is_of_a_tool() || matches!(self, Self::Io { .. })
    }

    /// True if what is missing or broken is a tool that not every machine has: what needs it can be left out.
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
                write!(f, "{tool} is not installed (looked for {looked}); install it with: {command}")
            }
            Self::SetUpFailed { tool, tried, command } => {
                write!(f, "{tool} could not be set up: {}; by hand: {command}", tried.join("; "))
            }
            Self::BrokenTool { tool, text } => write!(f, "{tool} does not work on this machine: {text}"),
            Self::Static => f.write_str(
                "this specgen is linked statically and cannot load the controller that it would build; take the command \
                 for glibc (specgen-VERSION-x86_64-unknown-linux-gnu.tar.gz), or build it from the sources: \
                 cargo install --path codegen/cli --locked",
            ),
            Self::BuildFailed { what, text } => write!(f, "building {what} failed:\n{text}"),
            Self::PanicPath { what, text } => write!(
                f,
                "{what} can panic: a panic path is left after optimisation, so the link was refused.\n\
                 Look for an index without a bound, an integer division by a run-time value, a slice range, \
                 or an unwrap in the controller or the runtime.\n{text}"
            ),
            Self::EmulatorFailed { text } => {
                write!(f, "the emulator ended without a result: {text}")
            }
            Self::EmulatorTimeout { seconds } => write!(
                f,
                "the emulator was still running after {seconds} s and was ended; replay fewer ticks or allow more time"
            ),
            Self::MalformedStats { text } => {
                write!(f, "the replay's result cannot be used: {text}")
            }
            Self::BadRequest { text } => write!(f, "this cannot be replayed: {text}"),
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
