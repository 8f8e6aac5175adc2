//! The output folder: written whole or not at all.
//!
//! A manifest (`.specgen`) lists every file with its SHA-256, so that a later run can tell its own output from somebody's
//! work. Everything is first written into a private folder on the same file system and then moved; a step that fails
//! takes back those before it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::sha256;

/// Name of the manifest in the output folder.
const MANIFEST: &str = ".specgen";
/// Build output and lock files that cargo makes in a workspace; never ours, never in the way.
const CARGO_MAKES: [&str; 2] = ["target", "Cargo.lock"];
/// As many files of somebody else as a message names.
const NAMED: usize = 5;

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
            Self::Io { action, source } => write!(
                f,
                "could not {action}: {source}; nothing was changed. Check permissions and free space, or name another folder with -o"
            ),
            Self::HalfWritten { dir, action, source } => write!(
                f,
                "could not {action}: {source}, nor put back what was there before: `{}` is half-written. \
                 Delete it, or name another folder with -o",
                dir.display()
            ),
        }
    }
}

impl std::error::Error for WriteError {}

/// Writes the workspace into `dir`, which must not exist, be empty, or hold nothing but an unchanged earlier output
/// (its `target` folders stay). A failure leaves everything as it was.
///
/// # Errors
/// See [`WriteError`].
pub fn write(dir: &Path, files: &BTreeMap<String, String>) -> Result<(), WriteError> {
    let known = check_free(dir)?;
    let mut undo = Undo::default();
    let done = stage_and_move(dir, files, &known, &mut undo);
    if done.is_err() {
        undo.folders();
    }
    match done {
        Err(WriteError::Io { action, source }) if undo.failed => {
            Err(WriteError::HalfWritten { dir: dir.to_owned(), action, source })
        }
        done => done,
    }
}

fn stage_and_move(
    dir: &Path,
    files: &BTreeMap<String, String>,
    known: &BTreeSet<String>,
    undo: &mut Undo,
) -> Result<(), WriteError> {
    let exists = dir.is_dir();
    // On the file system of the output: inside it if it is there (it may be a mount point), else beside it.
    let beside = match dir.parent() {
        _ if exists => dir,
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    undo.create_folders(beside)?;
    let staging = tempfile::Builder::new()
        .prefix(".specgen-")
        .tempdir_in(beside)
        .map_err(|e| io_error("create a folder in", beside, e))?;
    // The staging folder itself is private; what is made in it has the usual permissions.
    let new = staging.path().join("new");
    for (path, text) in files {
        put(&new.join(path), text)?;
    }
    put(&new.join(MANIFEST), &manifest(files))?;
    if !exists {
        return fs::rename(&new, dir).map_err(|e| io_error("create", dir, e));
    }
    let old = staging.path().join("old");
    fs::create_dir(&old).map_err(|e| io_error("create", &old, e))?;
    let moved = replace(dir, &new, &old, files, known, undo);
    // Before the staging folder goes, and with it what lay in the output before.
    if moved.is_err() {
        undo.moves();
    }
    moved
}

/// Moves what is replaced or no longer made from `dir` to `old`, and the new files into `dir`.
fn replace(
    dir: &Path,
    new: &Path,
    old: &Path,
    files: &BTreeMap<String, String>,
    known: &BTreeSet<String>,
    undo: &mut Undo,
) -> Result<(), WriteError> {
    let made: BTreeSet<&str> = files.keys().map(String::as_str).chain([MANIFEST]).collect();
    // Not only what is known: a file that cargo made may lie where one of ours goes.
    for path in made.iter().copied().chain(known.iter().map(String::as_str)) {
        let (from, aside) = (dir.join(path), old.join(path));
        if fs::symlink_metadata(&from).is_ok() {
            if let Some(folder) = aside.parent() {
                fs::create_dir_all(folder).map_err(|e| io_error("create", folder, e))?;
            }
            undo.rename(&from, &aside).map_err(|e| io_error("replace", &from, e))?;
        }
    }
    for path in made {
        let to = dir.join(path);
        if let Some(folder) = to.parent() {
            undo.create_folders(folder)?;
        }
        undo.rename(&new.join(path), &to).map_err(|e| io_error("write", &to, e))?;
    }
    // Folders that only the earlier output had; one that still holds something stays.
    for stale in known.iter().filter(|path| !files.contains_key(*path)) {
        for folder in Path::new(stale).ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty()) {
            let _ = fs::remove_dir(dir.join(folder));
        }
    }
    Ok(())
}

/// What was done so far, to be taken back in reverse order.
#[derive(Default)]
struct Undo {
    folders: Vec<PathBuf>,
    moves: Vec<(PathBuf, PathBuf)>,
    failed: bool,
}

impl Undo {
    /// Creates `folder` and what is missing above it.
    fn create_folders(&mut self, folder: &Path) -> Result<(), WriteError> {
        let missing: Vec<&Path> =
            folder.ancestors().take_while(|path| !path.as_os_str().is_empty() && !path.exists()).collect();
        for path in missing.into_iter().rev() {
            fs::create_dir(path).map_err(|e| io_error("create", path, e))?;
            self.folders.push(path.to_owned());
        }
        Ok(())
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)?;
        self.moves.push((from.to_owned(), to.to_owned()));
        Ok(())
    }

    fn moves(&mut self) {
        for (from, to) in self.moves.drain(..).rev() {
            self.failed |= fs::rename(to, from).is_err();
        }
    }

    fn folders(&mut self) {
        for folder in self.folders.drain(..).rev() {
            self.failed |= fs::remove_dir(folder).is_err();
        }
    }
}

/// The files of an unchanged earlier output in `dir`, the manifest included; none if it does not exist.
fn check_free(dir: &Path) -> Result<BTreeSet<String>, WriteError> {
    match fs::symlink_metadata(dir).and_then(|_| fs::metadata(dir)) {
        Ok(found) if !found.is_dir() => return Err(WriteError::NotAFolder { dir: dir.to_owned() }),
        Ok(_) => {}
        // A link to nothing is something.
        Err(error) if error.kind() == io::ErrorKind::NotFound && dir.is_symlink() => {
            return Err(WriteError::NotAFolder { dir: dir.to_owned() });
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        Err(error) => return Err(io_error("read", dir, error)),
    }
    // Without a manifest nothing here is ours.
    let recorded: BTreeMap<String, String> = fs::read_to_string(dir.join(MANIFEST))
        .unwrap_or_default()
        .lines()
        .filter_map(|line| line.split_once("  "))
        .map(|(digest, path)| (path.to_owned(), digest.to_owned()))
        .collect();
    let mut found = Found { recorded, ours: BTreeSet::new(), foreign: Vec::new() };
    found.walk(dir, "").map_err(|error| io_error("read", dir, error))?;
    found.lock_files(dir);
    if found.foreign.is_empty() {
        return Ok(found.ours);
    }
    let more = found.foreign.len().saturating_sub(NAMED);
    found.foreign.truncate(NAMED);
    if more > 0 {
        found.foreign.push(format!("and {more} more"));
    }
    Err(WriteError::Occupied { dir: dir.to_owned(), files: found.foreign })
}

/// What lies in an output folder.
struct Found {
    /// The manifest: path, digest.
    recorded: BTreeMap<String, String>,
    ours: BTreeSet<String>,
    foreign: Vec<String>,
}

impl Found {
    fn walk(&mut self, root: &Path, below: &str) -> io::Result<()> {
        for (path, kind) in entries(root, below)? {
            if kind.is_dir() {
                // Into a folder that no earlier run wrote to there is no need to look: it may be a whole disk.
                let prefix = format!("{path}/");
                if self.recorded.keys().any(|recorded| recorded.starts_with(&prefix)) {
                    self.walk(root, &path)?;
                } else if !entries(root, &path)?.is_empty() {
                    self.foreign.push(prefix);
                }
            } else if self.is_ours(root, &path, kind) {
                self.ours.insert(path);
            } else {
                self.foreign.push(path);
            }
        }
        Ok(())
    }

    /// Lock files that specgen wrote are its own even where cargo changed them since.
    fn lock_files(&mut self, root: &Path) {
        let within = |path: &str| Path::new(path).components().all(|part| matches!(part, Component::Normal(_)));
        let is_lock = |path: &str| Path::new(path).file_name().is_some_and(|name| name == "Cargo.lock");
        let locks = self.recorded.keys().filter(|path| is_lock(path) && within(path) && root.join(path).is_file());
        self.ours.extend(locks.cloned());
    }

    fn is_ours(&self, root: &Path, path: &str, kind: fs::FileType) -> bool {
        if !kind.is_file() {
            return false;
        }
        if path == MANIFEST {
            return !self.recorded.is_empty();
        }
        let Some(recorded) = self.recorded.get(path) else { return false };
        fs::read(root.join(path)).is_ok_and(|bytes| sha256(&bytes) == *recorded)
    }
}

/// What lies in the folder `below` of `root`, as path relative to `root` and kind, sorted, without what cargo makes.
pub(super) fn entries(root: &Path, below: &str) -> io::Result<Vec<(String, fs::FileType)>> {
    let mut out = Vec::new();
    for entry in fs::read_dir(root.join(below))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !CARGO_MAKES.contains(&name.as_str()) {
            let path = if below.is_empty() { name } else { format!("{below}/{name}") };
            out.push((path, entry.file_type()?));
        }
    }
    out.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(out)
}

fn put(path: &Path, text: &str) -> Result<(), WriteError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| io_error("create", folder, e))?;
    }
    fs::write(path, text).map_err(|e| io_error("write", path, e))
}

fn manifest(files: &BTreeMap<String, String>) -> String {
    files.iter().map(|(path, text)| format!("{}  {path}\n", sha256(text.as_bytes()))).collect()
}

fn io_error(verb: &str, path: &Path, source: io::Error) -> WriteError {
    WriteError::Io { action: format!("{verb} `{}`", path.display()), source }
}
