//! Why an output folder could not be written.

use std::io;
use std::path::{Path, PathBuf};

use specgen_language::outcome::Failure;

/// Why an output folder could not be written.
#[derive(Debug)]
pub enum WriteError {
    /// The folder holds files that specgen did not write, or that were changed since. Nothing was changed.
    Occupied {
        /// The folder.
        dir: PathBuf,
        /// Up to a few of the files, relative to it; a folder that is foreign as a whole ends in `/`.
        files: Vec<String>,
    },
    /// Something other than a folder has that name. Nothing was changed.
    NotAFolder {
        /// What was named as the output folder.
        dir: PathBuf,
    },
    /// Another run writes to it or builds in it. Nothing was changed.
    Busy {
        /// The folder.
        dir: PathBuf,
        /// That run: its process and command.
        owner: String,
    },
    /// The file system said no. Nothing was changed.
    Io {
        /// What was attempted.
        action: String,
        /// Its answer.
        source: io::Error,
    },
    /// The file system said no, and again when what had been done was to be undone.
    HalfWritten {
        /// The folder.
        dir: PathBuf,
        /// What was attempted.
        action: String,
        /// Its answer.
        source: io::Error,
    },
}

impl WriteError {
    pub(super) fn io(verb: &str, path: &Path, source: io::Error) -> Self {
        Self::Io { action: format!("{verb} `{}`", path.display()), source }
    }
}

impl std::fmt::Display for WriteError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Occupied { dir, files } => write!(
                f,
                "output folder `{}` holds files that specgen did not write or that were changed since: {}; \
                 nothing was written. Name another folder with -o, or move them away",
                dir.display(),
                files.join(", ")
            ),
            Self::NotAFolder { dir } => write!(
                f,
                "the output `{}` exists and is not a folder; nothing was written. Name a folder with -o, or move it away",
                dir.display()
            ),
            Self::Busy { dir, owner } => write!(
                f,
                "output folder `{}` is in use by {owner}; nothing was written. \
                 Run again when that has ended, or name another folder with -o",
                dir.display()
            ),
            Self::Io { action, source } => write!(
                f,
                "could not {action}: {source}; nothing was changed. Check permissions and free space, or name another folder with -o"
            ),
            Self::HalfWritten { dir, action, source } => write!(
                f,
                "could not {action}: {source}, nor put back what was there before: `{}` holds files of two versions. \
                 Run again when that is fixed, or name another folder with -o",
                dir.display()
            ),
        }
    }
}

impl std::error::Error for WriteError {}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        let message = error.to_string();
        match error {
            WriteError::Occupied { .. } | WriteError::NotAFolder { .. } => Self::Gate(message),
            _ => Self::Environment(message),
        }
    }
}
