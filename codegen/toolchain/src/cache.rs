//! Build cache in `builds` of the [user's cache folder](user_cache::folder), keyed by everything that determines the bytes of a
//! build.
//!
//! An entry is one file. Its name is the `key` of the build; its first line is the SHA-256 of that name and of the rest of the
//! file. It is written to a temporary file, renamed, and verified on every use. A damaged entry is removed and rebuilt. When the
//! cache is full, the least recently used entries are removed first. Concurrent programs may share the folder. If the folder
//! cannot be written, builds run without a cache and [`trouble`] returns a warning.

mod key;

use super::error::TargetError;
use super::user_cache;
use crate::sha256;
use key::Recipe;
use specgen_language::interrupt;
use std::fs::{self, File};
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::{Component, Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::SystemTime;

/// Size limit, bytes. A host library takes half a megabyte, a program for a real-time PC ten times as much.
pub const LIMIT: u64 = 1_000_000_000;

static OFF: AtomicBool = AtomicBool::new(false);
static TROUBLE: Mutex<Option<String>> = Mutex::new(None);

/// Disables the cache for the rest of this process.
pub fn switch_off() {
    OFF.store(true, Ordering::Relaxed);
}

/// The first problem with the cache in this process, as a warning. A build never fails because of the cache.
pub fn trouble() -> Option<String> {
    TROUBLE.lock().ok()?.clone()
}

fn say(text: String) {
    if let Ok(mut trouble) = TROUBLE.lock() {
        trouble.get_or_insert(text);
    }
}

/// The build cache.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
    limit: u64,
}

/// Size of the cache.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Number of builds.
    pub builds: usize,
    /// Bytes.
    pub bytes: u64,
}

/// A cached artifact.
#[derive(Debug, PartialEq, Eq)]
struct CachedFile {
    /// Path within cargo's target folder.
    place: PathBuf,
    bytes: Vec<u8>,
}

/// A file in the cache folder.
struct Entry {
    path: PathBuf,
    used: SystemTime,
    bytes: u64,
}

impl Entry {
    /// False for a temporary file that a killed process left.
    fn is_build(&self) -> bool {
        self.path.extension().is_none()
    }
}

impl Cache {
    /// The user's cache; `None` if [`user_cache::builds`] has none.
    pub fn of_user() -> Option<Self> {
        Some(Self { folder: user_cache::builds()?, limit: LIMIT })
    }

    /// Its folder, which may not exist yet.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its current size.
    ///
    /// # Errors
    /// [`TargetError::Io`] if the folder cannot be listed.
    pub fn extent(&self) -> Result<Extent, TargetError> {
        let entries = self.entries().map_err(|e| TargetError::io("listing", &self.folder, e))?;
        let builds = entries.iter().filter(|entry| entry.is_build()).count();
        Ok(Extent { builds, bytes: entries.iter().map(|entry| entry.bytes).sum() })
    }

    /// Removes all entries and returns their total size.
    ///
    /// # Errors
    /// [`TargetError::Io`] if a file cannot be removed.
    pub fn clear(&self) -> Result<Extent, TargetError> {
        let extent = self.extent()?;
        for entry in self.entries().map_err(|e| TargetError::io("listing", &self.folder, e))? {
            remove(&entry.path).map_err(|e| TargetError::io("removing", &entry.path, e))?;
        }
        Ok(extent)
    }

    /// All files; empty if the folder does not exist.
    fn entries(&self) -> io::Result<Vec<Entry>> {
        let listed = match fs::read_dir(&self.folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            listed => listed?,
        };
        let mut entries = Vec::new();
        for entry in listed {
            let entry = entry?;
            // Another process may have removed it just now.
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_file() {
                entries.push(Entry { path: entry.path(), used: metadata.modified()?, bytes: metadata.len() });
            }
        }
        Ok(entries)
    }

    /// The entry for this key, if it exists and is intact.
    fn fetch(&self, key: &str) -> Option<CachedFile> {
        let path = self.folder.join(key);
        let mut file = File::open(&path).ok()?;
        let mut content = Vec::new();
        let read = file.read_to_end(&mut content);
        let found = read.ok().and_then(|_| unpack(key, &content));
        if found.is_none() {
            say(format!("a cached build was damaged and is rebuilt: {}", path.display()));
            let _ = remove(&path);
        }
        // Marks the entry as recently used. Failing on a read-only disk is harmless.
        let _ = file.set_modified(SystemTime::now());
        found
    }

    /// Stores a build and removes old ones if the cache is too large.
    fn keep(&self, key: &str, place: &Path, bytes: &[u8]) -> io::Result<()> {
        let content = pack(key, place, bytes);
        if content.len() as u64 > self.limit {
            return Ok(());
        }
        fs::create_dir_all(&self.folder)?;
        replace(&self.folder.join(key), &content, false)?;
        self.make_room(key)
    }

    fn make_room(&self, newest: &str) -> io::Result<()> {
        let mut entries = self.entries()?;
        let mut bytes: u64 = entries.iter().map(|entry| entry.bytes).sum();
        // Ties are broken by path, so that the order is deterministic.
        entries.sort_by(|a, b| (a.used, &a.path).cmp(&(b.used, &b.path)));
        for entry in entries.iter().filter(|entry| !entry.path.ends_with(newest)) {
            if bytes <= self.limit {
                break;
            }
            remove(&entry.path)?;
            bytes -= entry.bytes;
        }
        Ok(())
    }
}

/// Removes a file; it is no error if another process already did.
fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Replaces a file atomically: readers never see half of it, and a process that has mapped or runs the old file keeps it.
pub(super) fn replace(path: &Path, content: &[u8], executable: bool) -> io::Result<()> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let _whole = interrupt::whole();
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let partial = path.with_extension(format!("{}-{count}.part", std::process::id()));
    let write = || {
        fs::write(&partial, content)?;
        if executable {
            fs::set_permissions(&partial, fs::Permissions::from_mode(0o755))?;
        }
        fs::rename(&partial, path)
    };
    write().inspect_err(|_| {
        let _ = fs::remove_file(&partial);
    })
}

/// Digest, path and content. The digest covers the key, so an entry under another name is invalid.
fn pack(key: &str, place: &Path, bytes: &[u8]) -> Vec<u8> {
    let body = [place.as_os_str().as_encoded_bytes(), b"\n", bytes].concat();
    let digest = sha256(&[key.as_bytes(), b"\n", &body].concat());
    [digest.as_bytes(), b"\n", &body].concat()
}

fn unpack(key: &str, content: &[u8]) -> Option<CachedFile> {
    let (digest, body) = content.split_at_checked(64)?;
    let body = body.strip_prefix(b"\n")?;
    if digest != sha256(&[key.as_bytes(), b"\n", body].concat()).as_bytes() {
        return None;
    }
    let end = body.iter().position(|&byte| byte == b'\n')?;
    let place = PathBuf::from(std::str::from_utf8(&body[..end]).ok()?);
    let is_below = place.components().all(|part| matches!(part, Component::Normal(_)));
    is_below.then(|| CachedFile { place, bytes: body[end + 1..].to_vec() })
}

/// A cache slot for one build.
pub(super) struct Slot {
    cache: Cache,
    recipe: Recipe,
}

impl Slot {
    /// The slot for building `package` with `command` and `rustc_args`; `None` if the cache is off, or if something outside the key could
    /// change the output.
    pub fn of(command: &Command, package: &Path, rustc_args: &[&str]) -> Option<Self> {
        let cache = if OFF.load(Ordering::Relaxed) { None } else { Cache::of_user() }?;
        Self::within(cache, command, package, rustc_args)
    }

    fn within(cache: Cache, command: &Command, package: &Path, rustc_args: &[&str]) -> Option<Self> {
        Some(Self { cache, recipe: Recipe::of(command, package, rustc_args)? })
    }

    /// A cached build, restored to its path in `target_dir`: path and bytes.
    ///
    /// # Errors
    /// [`TargetError::Io`] if it cannot be written.
    pub fn fetch(&self, target_dir: &Path) -> Result<Option<(PathBuf, Vec<u8>)>, TargetError> {
        let Some(CachedFile { place, bytes }) = self.cache.fetch(&self.recipe.key()) else { return Ok(None) };
        let path = target_dir.join(place);
        put(&path, &bytes)?;
        Ok(Some((path, bytes)))
    }

    /// Stores what was built, unless its sources have changed since.
    pub fn keep(self, target_dir: &Path, built: &Path, bytes: &[u8]) {
        let Ok(place) = built.strip_prefix(target_dir) else { return };
        if self.recipe.is_current()
            && let Err(error) = self.cache.keep(&self.recipe.key(), place, bytes)
        {
            say(format!("the build could not be cached in {}: {error}", self.cache.folder.display()));
        }
    }
}

/// Ensures that a library or program has this content. An existing file is read and compared.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<(), TargetError> {
    if fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.and_then(|()| replace(path, bytes, true)).map_err(|error| TargetError::io("writing", path, error))
}

#[cfg(test)]
mod tests;
