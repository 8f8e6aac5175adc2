//! Replaces files one by one if folders cannot be swapped. If a step fails, the steps before it are undone.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::super::contents::{MANIFEST, Manifest};
use super::super::error::WriteError;
use super::{Change, NEW, OLD, put_manifest, sync};

/// Moves replaced and obsolete files into the work folder, and the new files from there into the output.
pub(super) fn one_by_one(change: &Change<'_>) -> Result<(), WriteError> {
    let mut undo = Undo::default();
    let done = replace(change, &mut undo);
    if done.is_err() {
        undo.all();
    }
    match done {
        Err(WriteError::Io { action, source }) if undo.failed => {
            Err(WriteError::HalfWritten { dir: change.dir.to_owned(), action, source })
        }
        done => {
            // Obsolete files; if this fails, the next run removes them.
            let _ = fs::remove_dir_all(change.work.join(OLD));
            let _ = fs::remove_dir_all(change.work.join(NEW));
            done
        }
    }
}

fn replace(change: &Change<'_>, undo: &mut Undo) -> Result<(), WriteError> {
    let Change { dir, work, files, known, .. } = change;
    let manifest = dir.join(MANIFEST);
    know_both(change, undo).map_err(|e| WriteError::io("write", &manifest, e))?;
    let stale = || known.iter().filter(|path| *path != MANIFEST && !files.contains_key(*path));
    for path in stale().chain(files.keys()) {
        let (here, aside) = (dir.join(path), work.join(OLD).join(path));
        // Also for unknown entries: an empty folder, or a file of cargo, may have the path of one of ours.
        if fs::symlink_metadata(&here).is_ok() {
            if let Some(folder) = aside.parent() {
                fs::create_dir_all(folder).map_err(|e| WriteError::io("create", folder, e))?;
            }
            undo.rename(&here, &aside).map_err(|e| WriteError::io("replace", &here, e))?;
        }
        if files.contains_key(path) {
            if let Some(folder) = here.parent() {
                undo.create_folders(folder)?;
            }
            undo.rename(&work.join(NEW).join(path), &here).map_err(|e| WriteError::io("write", &here, e))?;
        }
    }
    let folders: BTreeSet<&Path> = files.keys().filter_map(|path| Path::new(path).parent()).collect();
    folders
        .iter()
        .try_for_each(|folder| sync(&dir.join(folder)))
        .and_then(|()| put_manifest(work, &Manifest::of(files), dir))
        .map_err(|e| WriteError::io("write", &manifest, e))?;
    // Folders that only the earlier output had, unless they are not empty.
    for path in stale() {
        for folder in Path::new(path).ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty()) {
            let _ = fs::remove_dir(dir.join(folder));
        }
    }
    Ok(())
}

/// Writes a manifest with the old and the new version of each file, so that after a kill the next run recognises every file.
fn know_both(change: &Change<'_>, undo: &mut Undo) -> io::Result<()> {
    let (place, before) = (change.dir.join(MANIFEST), change.work.join(OLD).join(MANIFEST));
    fs::create_dir_all(change.work.join(OLD))?;
    let mut both = Manifest::of(change.files);
    both.add(change.earlier);
    if change.earlier.is_empty() {
        put_manifest(change.work, &both, change.dir)?;
        // Undoing moves it to the work folder.
        undo.moves.push((before, place));
    } else {
        fs::copy(&place, &before)?;
        put_manifest(change.work, &both, change.dir)?;
        undo.moves.push((place, before));
    }
    Ok(())
}

/// Steps done so far, to be undone in reverse order.
#[derive(Default)]
struct Undo {
    folders: Vec<PathBuf>,
    moves: Vec<(PathBuf, PathBuf)>,
    failed: bool,
}

impl Undo {
    /// Creates `folder` and what is missing above it.
    fn create_folders(&mut self, folder: &Path) -> Result<(), WriteError> {
        let missing: Vec<&Path> = folder.ancestors().take_while(|path| !path.exists()).collect();
        for path in missing.into_iter().rev() {
            fs::create_dir(path).map_err(|e| WriteError::io("create", path, e))?;
            self.folders.push(path.to_owned());
        }
        Ok(())
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)?;
        self.moves.push((from.to_owned(), to.to_owned()));
        Ok(())
    }

    fn all(&mut self) {
        for (from, to) in self.moves.drain(..).rev() {
            self.failed |= fs::rename(to, from).is_err();
        }
        for folder in self.folders.drain(..).rev() {
            self.failed |= fs::remove_dir(folder).is_err();
        }
    }
}
