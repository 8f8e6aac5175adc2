//! Files that a command writes.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ui::Failure;
use crate::{lock, workspace};
use specgen_language::interrupt::{self, Claimed, Guard};

/// Writes `path` so that a failure leaves no half file: beside it, then renamed. What is not a regular file, such as a
/// device or a pipe, is written to and stays what it is; a link stays a link.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    PendingFile::with(path, bytes)?.keep()
}

/// Refuses a place where a file cannot be, before the minutes that its content takes.
pub fn check_place(path: &Path) -> Result<(), Failure> {
    // A pipe would wait for its reader.
    if is_device(path) { Ok(()) } else { PendingFile::create(path).map(|_| ()) }
}

/// Writes all files into a new or existing folder, all of them or none.
pub fn write_folder(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    let _claimed = claim(folder)?;
    let pending: Result<Vec<_>, _> =
        files.iter().map(|(name, bytes)| PendingFile::with(&folder.join(name), bytes)).collect();
    let pending = pending?;
    let _whole = interrupt::whole();
    pending.into_iter().try_for_each(PendingFile::put)
}

/// Makes a folder for results to come; it goes again if none comes.
pub fn claim(folder: &Path) -> Result<Claimed, Failure> {
    let failed = |reason: &dyn std::fmt::Display| {
        let shown = folder.display();
        Failure::Environment(format!(
            "could not create the folder `{shown}`: {reason}; nothing was changed. Name another with -o"
        ))
    };
    if folder.exists() && !folder.is_dir() {
        return Err(failed(&"a file has that name"));
    }
    Claimed::new(folder).map_err(|error| failed(&error))
}

/// Says which file could not be written.
pub fn unwritten(path: &Path, reason: &dyn std::fmt::Display) -> Failure {
    Failure::Environment(format!("could not write `{}`: {reason}; nothing was changed", path.display()))
}

/// Neither a regular file nor a folder: it cannot be replaced by another one.
fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// A file that is written piece by piece: beside its place, and put there when it is whole ([`PendingFile::keep`]).
pub struct PendingFile {
    place: Place,
    target: PathBuf,
}

enum Place {
    Beside {
        file: NamedTempFile,
        // After the file: it is kept in mind until it is gone.
        _guard: Guard,
        // After both: folders that were made for the file go again if it does not come.
        _claimed: Claimed,
    },
    /// A device or a pipe takes what comes.
    Device(fs::File),
}

impl PendingFile {
    pub fn create(path: &Path) -> Result<Self, Failure> {
        if path.is_dir() {
            return Err(unwritten(path, &"it is a folder, name a file in it"));
        }
        if is_device(path) {
            let file = fs::OpenOptions::new().write(true).open(path).map_err(|error| unwritten(path, &error))?;
            return Ok(Self { place: Place::Device(file), target: path.to_owned() });
        }
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let claimed = Claimed::new(folder).map_err(|error| {
            unwritten(path, &format_args!("could not create the folder `{}`: {error}", folder.display()))
        })?;
        let (file, guard) = Guard::file(|| temporary_beside(&target, folder), |file| file.path().to_owned())
            .map_err(|error| unwritten(path, &plain(&error)))?;
        Ok(Self { place: Place::Beside { file, _guard: guard, _claimed: claimed }, target })
    }

    /// A file that needs only to be kept.
    fn with(path: &Path, bytes: &[u8]) -> Result<Self, Failure> {
        let mut pending = Self::create(path)?;
        pending.write_all(bytes).map_err(|error| unwritten(path, &error))?;
        Ok(pending)
    }

    /// The file is whole.
    pub fn keep(self) -> Result<(), Failure> {
        let _whole = interrupt::whole();
        self.put()
    }

    fn put(self) -> Result<(), Failure> {
        let Self { place, target } = self;
        match place {
            Place::Device(_) => Ok(()),
            Place::Beside { file, _guard, _claimed } => {
                // On the disk before it takes the place of what was there.
                workspace::sync(file.path()).map_err(|error| unwritten(&target, &error))?;
                file.persist(&target).map_err(|error| unwritten(&target, &error.error))?;
                let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
                let _ = workspace::sync(folder.unwrap_or(Path::new(".")));
                Ok(())
            }
        }
    }
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.place {
            // The file below: the name that it has meanwhile is of no use in an error.
            Place::Beside { file, .. } => file.as_file_mut().write(bytes),
            Place::Device(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.place {
            Place::Beside { file, .. } => file.as_file_mut().flush(),
            Place::Device(file) => file.flush(),
        }
    }
}

/// What the system says, without the name of a temporary file, which is of no use to a reader.
fn plain(error: &io::Error) -> String {
    let below = error.get_ref().and_then(std::error::Error::source);
    below.map_or_else(|| error.to_string(), ToString::to_string)
}

/// A temporary file, but with the permissions of any other file: it becomes the user's. What killed processes left of theirs
/// goes.
fn temporary_beside(target: &Path, folder: &Path) -> io::Result<NamedTempFile> {
    let name: String = target.file_name().unwrap_or_default().to_string_lossy().chars().take(60).collect();
    let prefix = format!(".{name}.specgen-");
    lock::sweep(folder, &prefix);
    loop {
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.prefix(&prefix).tempfile_in(folder)?;
        // The lock lasts as long as any of the two is open.
        match file.as_file().try_clone().and_then(|same| lock::of(same, file.path())) {
            // Another process took it for one that was left.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
            Ok(_) => return Ok(file),
        }
    }
}
