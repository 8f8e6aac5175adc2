//! Contents of an output folder: files of specgen, of cargo, and of the user.
//!
//! The manifest (`.specgen`) lists every file with its SHA-256, so that a later run can distinguish its own output from the user's
//! work. While files are replaced one by one, it has a line for the old and one for the new version of each.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Component, Path};

use super::error::WriteError;
use specgen_toolchain::sha256;

/// Name of the manifest in the output folder.
pub(super) const MANIFEST: &str = ".specgen";
/// The work folder if it has to be inside the output.
pub(super) const WORK: &str = ".specgen-work";
/// Most foreign files that a message names.
const NAMED: usize = 5;

/// Files and their digests; a file may have two.
#[derive(Debug, Default)]
pub(super) struct Manifest(BTreeMap<String, BTreeSet<String>>);

impl Manifest {
    pub fn of(files: &BTreeMap<String, String>) -> Self {
        let digests = files.iter().map(|(path, text)| (path.clone(), BTreeSet::from([sha256(text.as_bytes())])));
        Self(digests.collect())
    }

    /// The manifest in `dir`; empty if there is none.
    pub fn read(dir: &Path) -> Self {
        let mut manifest = Self::default();
        for line in fs::read_to_string(dir.join(MANIFEST)).unwrap_or_default().lines() {
            // Ignore paths that lead out of the folder.
            if let Some((digest, path)) = line.split_once("  ")
                && Path::new(path).components().all(|part| matches!(part, Component::Normal(_)))
            {
                manifest.0.entry(path.to_owned()).or_default().insert(digest.to_owned());
            }
        }
        manifest
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds the digests of another manifest.
    pub fn add(&mut self, other: &Self) {
        for (path, digests) in &other.0 {
            self.0.entry(path.clone()).or_default().extend(digests.iter().cloned());
        }
    }

    pub fn text(&self) -> String {
        let lines = self.0.iter().flat_map(|(path, digests)| digests.iter().map(move |digest| (digest, path)));
        lines.map(|(digest, path)| format!("{digest}  {path}\n")).collect()
    }

    /// Whether it lists anything in the folder `path`.
    pub fn enters(&self, path: &str) -> bool {
        let prefix = format!("{path}/");
        self.0.keys().any(|recorded| recorded.starts_with(&prefix))
    }

    /// Whether cargo made this in one of our workspaces: its target folder, or a lock file next to one of our manifests.
    pub fn is_cargos(&self, path: &str) -> bool {
        let (folder, name) = path.rsplit_once('/').map_or(("", path), |(folder, name)| (folder, name));
        let package = if folder.is_empty() { "Cargo.toml".to_owned() } else { format!("{folder}/Cargo.toml") };
        name == "target" || (name == "Cargo.lock" && self.0.contains_key(&package))
    }

    /// Whether `root/path` is unchanged since specgen wrote it. Lock files may have been changed by cargo.
    pub fn is_ours(&self, root: &Path, path: &str, kind: fs::FileType) -> bool {
        if !kind.is_file() {
            return false;
        }
        if path == MANIFEST {
            return !self.is_empty();
        }
        let Some(digests) = self.0.get(path) else { return false };
        let is_lock = Path::new(path).file_name().is_some_and(|name| name == "Cargo.lock");
        is_lock || fs::read(root.join(path)).is_ok_and(|bytes| digests.contains(&sha256(&bytes)))
    }
}

/// Entries of the folder `below` of `root`, as path relative to `root` and kind, sorted.
pub(super) fn entries(root: &Path, below: &str) -> io::Result<Vec<(String, fs::FileType)>> {
    let mut out = Vec::new();
    for entry in fs::read_dir(root.join(below))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = if below.is_empty() { name } else { format!("{below}/{name}") };
        out.push((path, entry.file_type()?));
    }
    out.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(out)
}

/// The files of an unchanged earlier output in `dir`, the manifest included; none if it does not exist.
pub(super) fn check_free(dir: &Path, manifest: &Manifest) -> Result<BTreeSet<String>, WriteError> {
    match fs::symlink_metadata(dir).and_then(|_| fs::metadata(dir)) {
        Ok(found) if !found.is_dir() => return Err(WriteError::NotAFolder { dir: dir.to_owned() }),
        Ok(_) => {}
        // A link to nothing is something.
        Err(error) if error.kind() == io::ErrorKind::NotFound && dir.is_symlink() => {
            return Err(WriteError::NotAFolder { dir: dir.to_owned() });
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        Err(error) => return Err(WriteError::io("read", dir, error)),
    }
    let mut found = FolderContents { manifest, ours: BTreeSet::new(), foreign: Vec::new() };
    found.walk(dir, "").map_err(|error| WriteError::io("read", dir, error))?;
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

struct FolderContents<'a> {
    manifest: &'a Manifest,
    ours: BTreeSet<String>,
    foreign: Vec<String>,
}

impl FolderContents<'_> {
    fn walk(&mut self, root: &Path, below: &str) -> io::Result<()> {
        for (path, kind) in entries(root, below)? {
            if self.manifest.is_ours(root, &path, kind) {
                self.ours.insert(path);
            } else if self.manifest.is_cargos(&path) || path == WORK {
                // Neither ours nor foreign.
            } else if !kind.is_dir() {
                self.foreign.push(path);
            } else if self.manifest.enters(&path) {
                self.walk(root, &path)?;
            } else if self.holds_anything(root, &path)? {
                // Do not descend into a folder that no earlier run wrote to: it may be a whole disk.
                self.foreign.push(format!("{path}/"));
            }
        }
        Ok(())
    }

    fn holds_anything(&self, root: &Path, below: &str) -> io::Result<bool> {
        Ok(entries(root, below)?.iter().any(|(path, _)| !self.manifest.is_cargos(path)))
    }
}
