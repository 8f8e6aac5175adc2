//! Files that a command writes.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::arrays::{Form, Table};
use crate::files::{self, Destination, OutputError, ReadError};
use crate::interrupt::{self, Guard, ResultFolders};
use crate::lock;
use crate::outcome::Failure;

/// The text of a file that is named to a command.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    files::text(path).map_err(|unread| unread_file(path, &unread))
}

/// Refuses a file that cannot be read, before the minutes until it is.
pub fn check_input(path: &Path) -> Result<(), Failure> {
    files::look(path).map_err(|unread| unread_file(path, &unread))
}

/// Says which file could not be read. Its exit code is that of a spec or record which is refused, as it may be named in one.
pub fn unread_file(path: &Path, unread: &ReadError) -> Failure {
    Failure::Gate(format!("`{}` cannot be read: {unread}; {}", path.display(), unread.help()))
}

/// Writes `path` so that a failure leaves no half file: beside it, then renamed. What is not a regular file, such as a
/// device or a pipe, is written to and stays what it is; a link stays a link. An input of the command is refused, as everywhere
/// here.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    PendingFile::with(path, bytes)?.keep()
}

/// Writes a table: CSV, or the same as arrays if the name of the file asks for them.
pub fn write_table(path: &Path, csv: &[u8]) -> Result<(), Failure> {
    let mut file = TableFile::create(path)?;
    file.write_all(csv).map_err(|error| unwritten(path, &error))?;
    file.keep()
}

/// Writes a table of columns in the form that the name of the file asks for.
pub fn write_columns(path: &Path, table: &Table) -> Result<(), Failure> {
    let file = match Form::of(path) {
        Some(form) => form.file(table).map_err(|why| unwritten(path, &why))?,
        None => table.csv().into_bytes(),
    };
    let mut pending = PendingFile::of(path, files::guard_table)?;
    pending.write_all(&file).map_err(|error| unwritten(path, &error))?;
    pending.keep()
}

/// The same for an input, which the command is there to edit.
pub fn edit_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut pending = PendingFile::of(path, files::guard_edit)?;
    pending.write_all(bytes).map_err(|error| unwritten(path, &error))?;
    pending.keep()
}

/// Refuses an input that cannot be edited, before the minutes that its new content takes.
pub fn check_edit(path: &Path) -> Result<(), Failure> {
    files::guard_edit(path).map(|_| ()).map_err(|why| refused_output(path, &why))
}

/// Refuses a place where a file cannot be, before the minutes that its content takes.
pub fn check_place(path: &Path) -> Result<(), Failure> {
    check_permit(path, files::guard)
}

/// The same for a table.
pub fn check_table(path: &Path) -> Result<(), Failure> {
    check_permit(path, files::guard_table)
}

fn check_permit(path: &Path, guard: Permit) -> Result<(), Failure> {
    match guard(path) {
        // A pipe would wait for its reader.
        Ok(Destination::Device) => Ok(()),
        _ => PendingFile::of(path, guard).map(|_| ()),
    }
}

/// Writes a file in a temporary folder, whose folders are made.
pub fn write_scratch(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.and_then(|()| fs::write(path, bytes)).map_err(|error| unwritten(path, &error))
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
pub fn claim(folder: &Path) -> Result<ResultFolders, Failure> {
    let failed = |reason: &dyn std::fmt::Display| {
        let shown = folder.display();
        Failure::Environment(format!(
            "could not create the folder `{shown}`: {reason}; nothing was changed. Name another with -o"
        ))
    };
    if folder.exists() && !folder.is_dir() {
        return Err(failed(&"a file has that name"));
    }
    ResultFolders::new(folder).map_err(|error| failed(&error))
}

/// Says which file could not be written.
pub fn unwritten(path: &Path, reason: &dyn std::fmt::Display) -> Failure {
    Failure::Environment(format!("could not write `{}`: {reason}; nothing was changed", path.display()))
}

/// Says why a file may not be written. One that the command names twice is a mistake of its arguments.
pub fn refused_output(path: &Path, why: &OutputError) -> Failure {
    match why {
        OutputError::Input(_) | OutputError::Twice | OutputError::Arrays(_) => {
            Failure::Usage(format!("`{}` is not written: {why}; nothing was changed", path.display()))
        }
        _ => unwritten(path, why),
    }
}

/// A file that is written piece by piece: beside its place, and put there when it is whole ([`PendingFile::keep`]).
pub struct PendingFile {
    place: Place,
    target: PathBuf,
    /// Whether it may be written.
    guard: Permit,
}

type Permit = fn(&Path) -> Result<Destination, OutputError>;

enum Place {
    Beside {
        file: NamedTempFile,
        // After the file: it is kept in mind until it is gone.
        _guard: Guard,
        // After both: folders that were made for the file go again if it does not come.
        _claimed: ResultFolders,
    },
    /// A device or a pipe takes what comes.
    Device(fs::File),
}

impl PendingFile {
    /// Begins a file, which replaces the one at `path` when it is kept.
    ///
    /// # Errors
    /// The file may not be written, or not made.
    pub fn create(path: &Path) -> Result<Self, Failure> {
        Self::of(path, files::guard)
    }

    fn of(path: &Path, guard: Permit) -> Result<Self, Failure> {
        let target = match guard(path).map_err(|why| refused_output(path, &why))? {
            Destination::File(target) => target,
            Destination::Device => {
                let file = files::open_device(path).map_err(|why| refused_output(path, &why))?;
                return Ok(Self { place: Place::Device(file), target: path.to_owned(), guard });
            }
        };
        let folder = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let claimed = ResultFolders::new(folder).map_err(|error| {
            unwritten(path, &format_args!("could not create the folder `{}`: {error}", folder.display()))
        })?;
        let (file, passing) = Guard::file(|| temporary_beside(&target, folder), |file| file.path().to_owned())
            .map_err(|error| unwritten(path, &plain(&error)))?;
        let place = Place::Beside { file, _guard: passing, _claimed: claimed };
        Ok(Self { place, target, guard })
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
        let Self { place, target, guard } = self;
        match place {
            Place::Device(_) => Ok(()),
            Place::Beside { file, _guard, _claimed } => {
                // It may have been read, or changed, meanwhile.
                guard(&target).map_err(|why| refused_output(&target, &why))?;
                // A file that others may not read stays one.
                if let Ok(before) = fs::metadata(&target) {
                    let _ = fs::set_permissions(file.path(), before.permissions());
                }
                // On the disk before it takes the place of what was there.
                files::sync(file.path()).map_err(|error| unwritten(&target, &error))?;
                file.persist(&target).map_err(|error| unwritten(&target, &error.error))?;
                let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
                let _ = files::sync(folder.unwrap_or(Path::new(".")));
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

/// A table that is written as CSV, row by row. It becomes arrays if the name of the file asks for them.
pub struct TableFile {
    file: PendingFile,
    /// Form of the arrays, and the table until it is whole.
    arrays: Option<(Form, Vec<u8>)>,
}

impl TableFile {
    /// As [`PendingFile::create`].
    ///
    /// # Errors
    /// The file may not be written, or not made.
    pub fn create(path: &Path) -> Result<Self, Failure> {
        let file = PendingFile::of(path, files::guard_table)?;
        Ok(Self { file, arrays: Form::of(path).map(|form| (form, Vec::new())) })
    }

    /// The table is whole.
    pub fn keep(mut self) -> Result<(), Failure> {
        if let Some((form, csv)) = self.arrays.take() {
            let arrays = form.of_csv(&csv).map_err(|why| unwritten(&self.file.target, &why))?;
            self.file.write_all(&arrays).map_err(|error| unwritten(&self.file.target, &error))?;
        }
        self.file.keep()
    }
}

impl Write for TableFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some((_, csv)) = &mut self.arrays { csv.write(bytes) } else { self.file.write(bytes) }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a folder of results would replace is as safe as a file that is named.
    #[test]
    fn a_folder_of_results_replaces_no_input() {
        files::forget_inputs();
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("runs.csv"), "mine").unwrap();
        let results = [("report.json", "new"), ("runs.csv", "new")];
        let results = results.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec()));
        assert_eq!(read_text(&at("runs.csv")).unwrap(), "mine");
        let refused = write_folder(folder.path(), &results).unwrap_err();
        assert!(matches!(refused, Failure::Usage(text) if text.contains("runs.csv` is not written")));
        assert!(fs::read_to_string(at("runs.csv")).unwrap() == "mine" && !at("report.json").exists());
        edit_file(&at("runs.csv"), b"edited").unwrap();
        files::forget_inputs();
        write_folder(folder.path(), &results).unwrap();
        assert_eq!(fs::read_to_string(at("runs.csv")).unwrap(), "new");
    }
}
