//! Writes the output folder completely or not at all, even if the process is killed.
//!
//! Every file is first written into a work folder beside the output, then the two folders are swapped atomically. Other contents of
//! the old folder (cargo's `target`) are carried over. If the folders cannot be swapped, for example at a mount point, files are
//! replaced one by one with a manifest that lists both versions, so that the next run recognises the files of a killed one.

mod replace;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::contents::{MANIFEST, Manifest, WORK, check_free, entries};
use super::error::WriteError;
use super::hold::Hold;
use specgen_language::files::sync;
use specgen_language::interrupt;

/// In the work folder: the new output; after the swap, the old one.
const NEW: &str = "new";
/// In the work folder: files that were replaced one by one.
const OLD: &str = "old";
/// In the work folder: the next manifest.
const NEXT_MANIFEST: &str = "manifest";

/// Writes the workspace into `dir`, which must not exist, be empty, or contain only an unchanged earlier output (its `target`
/// folders are kept). A failure leaves everything unchanged. No other run writes or builds there until the returned value is
/// dropped.
///
/// # Errors
/// See [`WriteError`].
pub fn write(dir: &Path, files: &BTreeMap<String, String>) -> Result<Hold, WriteError> {
    let place = Place::of(dir)?;
    let hold = Hold::take(&place.work, dir)?;
    let _whole = interrupt::whole();
    take_up(&place).map_err(|e| WriteError::io("recover the files of a killed run in", &place.work, e))?;
    let earlier = Manifest::read(dir);
    let known = check_free(dir, &earlier)?;
    check_writable(dir, &known)?;
    let change = Change { dir, work: &place.work, files, earlier: &earlier, known: &known };
    let done = stage(&place.work, files).and_then(|()| put(&place, &change));
    if done.is_err() {
        // Only new files: a swap is atomic.
        let _ = fs::remove_dir_all(place.work.join(NEW));
    }
    // Not with `map`: that would drop `hold`, which waits for `_whole`, first.
    done?;
    Ok(hold)
}

/// Writes the files into a temporary folder of this process without checking or keeping its contents.
///
/// # Errors
/// See [`WriteError`].
pub fn write_scratch(dir: &Path, files: &BTreeMap<String, String>) -> Result<(), WriteError> {
    files.iter().try_for_each(|(path, text)| write_file(&dir.join(path), text))
}

/// Paths of the output and of the work folder.
struct Place {
    dir: PathBuf,
    work: PathBuf,
    /// Whether the folder may be replaced: it is not a mount point, and not the current directory of this process.
    may_swap: bool,
}

impl Place {
    fn of(dir: &Path) -> Result<Self, WriteError> {
        let exists = dir.exists();
        let dir = if exists { fs::canonicalize(dir) } else { std::path::absolute(dir) }
            .map_err(|error| WriteError::io("find", dir, error))?;
        let inside = dir.join(WORK);
        let beside = match (dir.parent(), dir.file_name()) {
            (Some(parent), Some(name))
                if !(exists && (system::is_mount(&dir) || system::check_writable(parent).is_err())) =>
            {
                Some(parent.join(format!(".{}.specgen", name.to_string_lossy())))
            }
            _ => None,
        };
        let here = std::env::current_dir().and_then(fs::canonicalize);
        let is_inside = here.is_ok_and(|here| here.starts_with(&dir));
        Ok(match beside {
            // If the other exists, a run with other rights was killed there, and it must be recovered.
            Some(work) if !inside.exists() => Self { may_swap: !is_inside && system::is_mine(&dir), dir, work },
            _ => Self { dir, work: inside, may_swap: false },
        })
    }
}

/// A change of an output.
struct Change<'a> {
    dir: &'a Path,
    work: &'a Path,
    files: &'a BTreeMap<String, String>,
    /// The manifest of the earlier output, and which of its files exist.
    earlier: &'a Manifest,
    known: &'a BTreeSet<String>,
}

/// Writes and syncs all new files; the manifest last, as a sign that they are complete.
fn stage(work: &Path, files: &BTreeMap<String, String>) -> Result<(), WriteError> {
    let new = work.join(NEW);
    write_scratch(&new, files)?;
    sync_tree(&new)
        .and_then(|()| put_manifest(work, &Manifest::of(files), &new))
        .map_err(|error| WriteError::io("write", &new, error))
}

/// Writes a manifest into `folder`, atomically and synced.
fn put_manifest(work: &Path, manifest: &Manifest, folder: &Path) -> io::Result<()> {
    let beside = work.join(NEXT_MANIFEST);
    fs::write(&beside, manifest.text())?;
    let moved = sync(&beside).and_then(|()| fs::rename(&beside, folder.join(MANIFEST)));
    if moved.is_err() {
        // Clean up after the failure.
        let _ = fs::remove_file(&beside);
    }
    moved?;
    sync(folder)
}

fn put(place: &Place, change: &Change<'_>) -> Result<(), WriteError> {
    let new = place.work.join(NEW);
    if !change.dir.exists() {
        fs::rename(&new, change.dir).map_err(|error| WriteError::io("create", change.dir, error))?;
        let _ = place.dir.parent().map(sync);
        return Ok(());
    }
    // Without a manifest, the earlier output could not be distinguished from incomplete files after a kill.
    if place.may_swap && !change.earlier.is_empty() && swap(&new, &place.dir).is_ok() {
        // The output is complete; the next run carries over what could not be moved now.
        let _ = carry_over(&new, &place.dir);
        return Ok(());
    }
    replace::one_by_one(change)
}

/// Swaps both folders atomically.
fn swap(new: &Path, dir: &Path) -> io::Result<()> {
    fs::set_permissions(new, fs::metadata(dir)?.permissions())?;
    system::exchange(new, dir)?;
    // A power failure before or after this leaves one of the two.
    let _ = dir.parent().map(sync);
    Ok(())
}

/// Recovers what a killed run left in the work folder.
fn take_up(place: &Place) -> io::Result<()> {
    let is_left = |left: &Path| fs::symlink_metadata(left).is_ok();
    let [new, old, manifest] = [NEW, OLD, NEXT_MANIFEST].map(|name| place.work.join(name));
    if is_left(&new) {
        carry_over(&new, &place.dir)?;
    }
    // Files that were ours.
    if is_left(&old) {
        fs::remove_dir_all(old)?;
    }
    if is_left(&manifest) { fs::remove_file(manifest) } else { Ok(()) }
}

/// Removes an output that was replaced or never complete. Files that specgen did not make are moved into `dir`.
fn carry_over(left: &Path, dir: &Path) -> io::Result<()> {
    let manifest = Manifest::read(left);
    // Without a manifest it was never complete, so that nobody else has put anything there.
    if !manifest.is_empty() {
        carry_folder(left, "", dir, &manifest)?;
    }
    fs::remove_dir_all(left)
}

fn carry_folder(left: &Path, below: &str, dir: &Path, manifest: &Manifest) -> io::Result<()> {
    for (path, kind) in entries(left, below)? {
        let to = dir.join(&path);
        if manifest.is_ours(left, &path, kind) {
            continue;
        }
        if kind.is_dir() && !manifest.is_cargos(&path) && (manifest.enters(&path) || entries(left, &path)?.is_empty()) {
            carry_folder(left, &path, dir, manifest)?;
        } else if fs::symlink_metadata(&to).is_err() {
            if let Some(folder) = to.parent() {
                fs::create_dir_all(folder)?;
            }
            fs::rename(left.join(&path), &to)?;
        } else if !manifest.is_cargos(&path) {
            let text = format!("`{}` and `{}` both exist; keep one", left.join(&path).display(), to.display());
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
        }
    }
    Ok(())
}

/// Refuses folders without write permission.
fn check_writable(dir: &Path, known: &BTreeSet<String>) -> Result<(), WriteError> {
    let folders: BTreeSet<PathBuf> =
        known.iter().filter_map(|path| dir.join(path).parent().map(Path::to_owned)).collect();
    folders
        .iter()
        .try_for_each(|folder| system::check_writable(folder).map_err(|error| WriteError::io("write", folder, error)))
}

fn write_file(path: &Path, text: &str) -> Result<(), WriteError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| WriteError::io("create", folder, e))?;
    }
    fs::write(path, text).map_err(|e| WriteError::io("write", path, e))
}

fn sync_tree(root: &Path) -> io::Result<()> {
    for entry in fs::read_dir(root)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() { sync_tree(&entry.path())? } else { sync(&entry.path())? }
    }
    sync(root)
}

/// System calls.
#[cfg(target_os = "linux")]
mod system {
    use std::io;
    use std::path::Path;

    use rustix::fs::{self, AtFlags, CWD, RenameFlags, StatxFlags};

    pub fn exchange(a: &Path, b: &Path) -> io::Result<()> {
        Ok(fs::renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
    }

    pub fn is_mount(dir: &Path) -> bool {
        let found = fs::statx(CWD, dir, AtFlags::empty(), StatxFlags::empty());
        found.is_ok_and(|found| found.stx_attributes.contains(fs::StatxAttributes::MOUNT_ROOT))
    }

    pub fn check_writable(dir: &Path) -> io::Result<()> {
        Ok(fs::access(dir, fs::Access::WRITE_OK | fs::Access::EXEC_OK)?)
    }

    pub fn is_mine(dir: &Path) -> bool {
        fs::stat(dir).is_ok_and(|found| found.st_uid == rustix::process::geteuid().as_raw())
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::io;
    use std::path::Path;

    pub fn exchange(_: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub fn is_mount(_: &Path) -> bool {
        false
    }

    pub fn check_writable(dir: &Path) -> io::Result<()> {
        let closed = std::fs::metadata(dir)?.permissions().readonly();
        if closed { Err(io::ErrorKind::PermissionDenied.into()) } else { Ok(()) }
    }

    pub fn is_mine(_: &Path) -> bool {
        true
    }
}
