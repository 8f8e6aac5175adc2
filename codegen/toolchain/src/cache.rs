//! Builds that are kept by what they are made of, so that nothing is compiled twice: `builds` in the
//! [folder of the user's cache](user_cache::folder).
//!
//! An entry is one file: its name is the `key` of the build, its first line the SHA-256 of that name and of all that follows.
//! It is written beside its place and renamed, and checked whenever it is taken: one that is damaged is removed and built
//! anew. What was used longest ago goes first when there is too much. Programs that run at once may share the folder. Where it
//! cannot be written, builds are made as if it were not there; [`trouble`] says so.

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

/// Bytes that are kept at most. A host library has half a million, a program of a real-time PC ten times as many.
pub const LIMIT: u64 = 1_000_000_000;

static OFF: AtomicBool = AtomicBool::new(false);
static TROUBLE: Mutex<Option<String>> = Mutex::new(None);

/// From now on this process takes nothing that was kept and keeps nothing.
pub fn switch_off() {
    OFF.store(true, Ordering::Relaxed);
}

/// The first thing that went wrong with kept builds in this process, in words for a warning. No build fails by it.
#[must_use]
pub fn trouble() -> Option<String> {
    TROUBLE.lock().ok()?.clone()
}

fn say(text: String) {
    if let Ok(mut trouble) = TROUBLE.lock() {
        trouble.get_or_insert(text);
    }
}

/// The folder of kept builds.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
    limit: u64,
}

/// How much is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Builds.
    pub builds: usize,
    /// Bytes that they take.
    pub bytes: u64,
}

/// What was found under a key.
#[derive(Debug, PartialEq, Eq)]
struct CachedFile {
    /// Where cargo had left it in its target folder.
    place: PathBuf,
    bytes: Vec<u8>,
}

/// A file in the folder.
struct Entry {
    path: PathBuf,
    used: SystemTime,
    bytes: u64,
}

impl Entry {
    /// Whether it is a whole build, and not what an ended process left.
    fn is_build(&self) -> bool {
        self.path.extension().is_none()
    }
}

impl Cache {
    /// That of the user; none if [`user_cache::folder`] has none.
    #[must_use]
    pub fn of_user() -> Option<Self> {
        Some(Self { folder: user_cache::builds()?, limit: LIMIT })
    }

    /// Where it is, whether or not something is kept yet.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// How much is in it now.
    ///
    /// # Errors
    /// [`TargetError::Io`] if it cannot be listed.
    pub fn extent(&self) -> Result<Extent, TargetError> {
        let entries = self.entries().map_err(|e| TargetError::io("listing", &self.folder, e))?;
        let builds = entries.iter().filter(|entry| entry.is_build()).count();
        Ok(Extent { builds, bytes: entries.iter().map(|entry| entry.bytes).sum() })
    }

    /// Removes all that is kept, and says how much that was.
    ///
    /// # Errors
    /// [`TargetError::Io`] if something cannot be removed.
    pub fn clear(&self) -> Result<Extent, TargetError> {
        let extent = self.extent()?;
        for entry in self.entries().map_err(|e| TargetError::io("listing", &self.folder, e))? {
            remove(&entry.path).map_err(|e| TargetError::io("removing", &entry.path, e))?;
        }
        Ok(extent)
    }

    /// All files; none if there is no folder.
    fn entries(&self) -> io::Result<Vec<Entry>> {
        let listed = match fs::read_dir(&self.folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            listed => listed?,
        };
        let mut entries = Vec::new();
        for entry in listed {
            let entry = entry?;
            // Another process may just have removed it.
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_file() {
                entries.push(Entry { path: entry.path(), used: metadata.modified()?, bytes: metadata.len() });
            }
        }
        Ok(entries)
    }

    /// What is kept under this key, if it is there and whole.
    fn fetch(&self, key: &str) -> Option<CachedFile> {
        let path = self.folder.join(key);
        let mut file = File::open(&path).ok()?;
        let mut content = Vec::new();
        let read = file.read_to_end(&mut content);
        let found = read.ok().and_then(|_| unpack(key, &content));
        if found.is_none() {
            say(format!("a kept build was damaged and is built anew: {}", path.display()));
            let _ = remove(&path);
        }
        // For whoever looks for what was used longest ago; on a read-only disk nobody does.
        let _ = file.set_modified(SystemTime::now());
        found
    }

    /// Keeps a build, and lets go of others if there is too much.
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
        // Two of the same moment: whichever, but the same one everywhere.
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

/// Removes a file that another process may have removed before.
fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes a file beside its place and renames it: nobody finds half of it, and whoever has mapped or runs the old one keeps it.
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

/// Digest, place and content; the digest covers the key, so that an entry under another name is none.
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

/// One build to be made or taken.
pub(super) struct Slot {
    cache: Cache,
    recipe: Recipe,
}

impl Slot {
    /// The place for what `command` makes of `package` with `rustc_args`; none if nothing is to be kept, or if something may
    /// decide about the bytes that a key does not see.
    pub fn of(command: &Command, package: &Path, rustc_args: &[&str]) -> Option<Self> {
        let cache = if OFF.load(Ordering::Relaxed) { None } else { Cache::of_user() }?;
        Self::within(cache, command, package, rustc_args)
    }

    fn within(cache: Cache, command: &Command, package: &Path, rustc_args: &[&str]) -> Option<Self> {
        Some(Self { cache, recipe: Recipe::of(command, package, rustc_args)? })
    }

    /// What was made earlier, if it was, put where cargo would have left it in `target_dir`: path and bytes.
    ///
    /// # Errors
    /// [`TargetError::Io`] if it cannot be put there.
    pub fn fetch(&self, target_dir: &Path) -> Result<Option<(PathBuf, Vec<u8>)>, TargetError> {
        let Some(CachedFile { place, bytes }) = self.cache.fetch(&self.recipe.key()) else { return Ok(None) };
        let path = target_dir.join(place);
        put(&path, &bytes)?;
        Ok(Some((path, bytes)))
    }

    /// Keeps what was built, unless its sources were changed meanwhile.
    pub fn keep(self, target_dir: &Path, built: &Path, bytes: &[u8]) {
        let Ok(place) = built.strip_prefix(target_dir) else { return };
        if self.recipe.is_current()
            && let Err(error) = self.cache.keep(&self.recipe.key(), place, bytes)
        {
            say(format!("what was built could not be kept in {}: {error}", self.cache.folder.display()));
        }
    }
}

/// Makes sure that a library or program has this content. What is there already is read and compared, not believed.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<(), TargetError> {
    if fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.and_then(|()| replace(path, bytes, true)).map_err(|error| TargetError::io("writing", path, error))
}

#[cfg(test)]
mod tests;
