//! Locks that end with their process, however it ends. They distinguish files of a killed process from files in use.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

/// Makes the file if it does not exist, and locks it; `WouldBlock` if another process has it.
///
/// # Errors
/// `WouldBlock`, or the error of the file system.
pub fn make(path: &Path) -> io::Result<File> {
    of(OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?, path)
}

/// Locks an open file or folder. It must still be the one at `path`: the last owner of the lock may have removed it.
///
/// # Errors
/// As [`make`].
pub fn of(file: File, path: &Path) -> io::Result<File> {
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::WouldBlock.into()),
        // A file system without locks: there the user must not start two runs at a time.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
        Err(TryLockError::Error(error)) => return Err(error),
    }
    if is_at(&file, path) { Ok(file) } else { Err(io::ErrorKind::WouldBlock.into()) }
}

/// Removes this user's files and folders in `folder` whose names begin with `prefix`, unless a living process has
/// locked them.
pub fn sweep(folder: &Path, prefix: &str) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(prefix) {
            continue;
        }
        let path = entry.path();
        let Ok(found) = fs::symlink_metadata(&path) else { continue };
        if found.is_symlink() || !is_own(&found) {
            continue;
        }
        // Held during the removal, so that nobody starts to use it.
        if let Ok(_held) = File::open(&path).and_then(|file| of(file, &path)) {
            let _ = if found.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        }
    }
}

/// Whether it belongs to this user.
#[cfg(unix)]
pub fn is_own(found: &fs::Metadata) -> bool {
    std::os::unix::fs::MetadataExt::uid(found) == rustix::process::geteuid().as_raw()
}

/// Whether it belongs to this user; decided by permissions if users have no numbers.
#[cfg(not(unix))]
pub fn is_own(_: &fs::Metadata) -> bool {
    true
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |found: fs::Metadata| (found.dev(), found.ino());
    fs::symlink_metadata(path).map(place).is_ok_and(|there| file.metadata().map(place).is_ok_and(|own| own == there))
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_has_locked_is_swept() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["own-left", "own-held", "theirs"] {
            fs::write(at(name), "x").unwrap();
        }
        fs::create_dir_all(at("own-tree/below")).unwrap();
        let held = make(&at("own-held")).unwrap();
        assert_eq!(make(&at("own-held")).unwrap_err().kind(), io::ErrorKind::WouldBlock);
        sweep(folder.path(), "own-");
        let there = ["own-left", "own-tree", "own-held", "theirs"].map(|name| at(name).exists());
        assert_eq!(there, [false, false, true, true]);
        drop(held);
        sweep(folder.path(), "own-");
        assert!(!at("own-held").exists());
    }

    #[test]
    fn a_lock_whose_file_was_replaced_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let opened = File::create(&path).unwrap();
        fs::remove_file(&path).unwrap();
        assert!(of(opened.try_clone().unwrap(), &path).is_err());
        fs::write(&path, "another").unwrap();
        assert!(of(opened, &path).is_err());
    }
}
