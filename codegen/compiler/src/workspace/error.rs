//! Errors of writing an output folder.

use std::io;
use std::path::{Path, PathBuf};

use specgen_language::outcome::Failure;

/// Error of writing an output folder.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The folder holds files that specgen did not write, or that were changed since. Nothing was changed.
    #[error(
        "output folder `{}` contains files that specgen did not write or that were changed since: {}; \
         nothing was written. Name another folder with -o, or move them away",
        dir.display(), files.join(", ")
    )]
    Occupied {
        /// The folder.
        dir: PathBuf,
        /// A few of the files, relative to it; a path of a folder that specgen never wrote to ends in `/`.
        files: Vec<String>,
    },
    /// Something other than a folder has that name. Nothing was changed.
    #[error(
        "the output `{}` exists and is not a folder; nothing was written. Name a folder with -o, or move it away",
        dir.display()
    )]
    NotAFolder {
        /// The output path.
        dir: PathBuf,
    },
    /// Another run is writing to the folder or building in it. Nothing was changed.
    #[error(
        "output folder `{}` is in use by {owner}; nothing was written. \
         Run again when it has finished, or name another folder with -o",
        dir.display()
    )]
    Busy {
        /// The folder.
        dir: PathBuf,
        /// Process and command of that run.
        owner: String,
    },
    /// An I/O error. Nothing was changed.
    #[error(
        "could not {action}: {source}; nothing was changed. Check permissions and free space, or name another folder with -o"
    )]
    Io {
        /// The attempted action.
        action: String,
        /// Its error.
        source: io::Error,
    },
    /// An I/O error, and another one while undoing the changes.
    #[error(
        "could not {action}: {source}; restoring the previous files failed, too: `{}` contains files of two versions. \
         Run again when that is fixed, or name another folder with -o",
        dir.display()
    )]
    HalfWritten {
        /// The folder.
        dir: PathBuf,
        /// The attempted action.
        action: String,
        /// Its error.
        source: io::Error,
    },
}

impl WriteError {
    pub(super) fn io(verb: &str, path: &Path, source: io::Error) -> Self {
        Self::Io { action: format!("{verb} `{}`", path.display()), source }
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        let message = error.to_string();
        match error {
            WriteError::Occupied { .. } | WriteError::NotAFolder { .. } => Self::Gate(message),
            _ => Self::Environment(message),
        }
    }
}
