//! Single files that a command writes.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::ui::Failure;

/// Writes `path` so that a failure leaves no half file: beside it, then renamed. What is not a regular file, such as a
/// device or a pipe, is written to and stays what it is; a link stays a link.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let failed = |reason: &dyn std::fmt::Display| {
        Failure::Environment(format!("could not write `{}`: {reason}; nothing was changed", path.display()))
    };
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(failed(&"it is a folder, name a file in it")),
        Ok(found) if !found.is_file() => {
            let mut device = fs::OpenOptions::new().write(true).open(path).map_err(|error| failed(&error))?;
            return device.write_all(bytes).map_err(|error| failed(&error));
        }
        _ => {}
    }
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(failed(&format_args!("there is no folder `{}`", folder.display())));
    }
    let mut file = temporary_in(folder).map_err(|error| failed(&error))?;
    file.write_all(bytes).map_err(|error| failed(&error))?;
    file.persist(&target).map_err(|error| failed(&error.error))?;
    Ok(())
}

/// A file that is written piece by piece: beside its place, and put there when it is whole ([`PendingFile::keep`]).
pub struct PendingFile {
    file: tempfile::NamedTempFile,
    target: PathBuf,
}

impl PendingFile {
    /// Begins a file.
    pub fn create(path: &Path) -> Result<Self, Failure> {
        let failed = |reason: &dyn std::fmt::Display| {
            Failure::Environment(format!("could not write `{}`: {reason}; nothing was changed", path.display()))
        };
        if path.is_dir() {
            return Err(failed(&"it is a folder, name a file in it"));
        }
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(failed(&format_args!("there is no folder `{}`", folder.display())));
        }
        let file = temporary_in(folder).map_err(|error| failed(&error))?;
        Ok(Self { file, target })
    }

    /// The file is whole.
    pub fn keep(self) -> Result<(), Failure> {
        let Self { file, target } = self;
        file.persist(&target).map(|_| ()).map_err(|error| {
            Failure::Environment(format!(
                "could not write `{}`: {}; nothing was changed",
                target.display(),
                error.error
            ))
        })
    }
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A temporary file, but with the permissions of any other file: it becomes the user's.
fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}
