//! Shared memory between a controller and the machine that it moves.
//!
//! One file of 64-bit words, mapped by both sides. The machine's side creates it; a controller opens it. It has two
//! blocks, each written by one side and read by the other, with a counter that is odd while the block changes:
//!
//! ```text
//! actuation  controller → machine   session, tick, enable, six converter codes
//! sensing    machine → controller   session, tick, six converter codes, wrench (six words)
//! ```
//! Time is counted in ticks of the controller. After the actuation of tick n, the machine runs for one period with it
//! and publishes the sensing of tick n + 1 in advance. A controller that skipped ticks requests the sensing of a later
//! one by the word `wanted`: the machine then continues with the codes that it has, as a real one would.
//!
//! A waiting side polls the words for a while and then sleeps on a futex, so that neither side needs its own processor.
//! Only a sleeping side is woken: a system call costs the real-time thread more than the rest of a tick.
#![allow(unsafe_code)] // Mapping and futex calls; each says why it is sound. The words themselves are atomics.

mod mapping;
mod words;

// `words` uses these from here.
use core::hint;
use core::sync::atomic::{self, Ordering};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::clock;
use mapping::{MapError, Mapping};
use words::SharedWords;
pub use words::{Actuation, Sensing};

/// "SPGPLANT" in little-endian bytes.
const MAGIC: u64 = u64::from_le_bytes(*b"SPGPLANT");
const VERSION: u64 = 1;
/// Polling time of a waiting controller before it sleeps, ns.
const LOOK: u64 = 30_000;
/// Attempts to read a block while the other side writes it; a write takes some 50 ns.
const TRIES: usize = 10_000;

/// Six legs, six gauges.
pub const CHANNELS: usize = 6;

/// Reason why a machine cannot be reached.
#[derive(Debug)]
pub enum OpenError {
    /// The file does not exist, or access is denied.
    File {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        cause: io::Error,
    },
    /// Another user can change the file, or a folder above it.
    NotOwn {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        why: String,
    },
    /// The file is something else, or of another version.
    NotAMachine {
        /// The file.
        path: PathBuf,
    },
    /// It is the machine of another spec.
    OtherSpec {
        /// The file.
        path: PathBuf,
        /// First half of its digest.
        found: String,
    },
    /// A machine of this name is already being served.
    Served {
        /// The file.
        path: PathBuf,
        /// Process that serves it.
        process: u64,
    },
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, cause } if cause.kind() == io::ErrorKind::NotFound => write!(
                f,
                "{}: no simulated machine there; start one with `specgen plant SPEC` and give both the same --name",
                path.display()
            ),
            Self::File { path, cause } => {
                write!(f, "{}: {cause}; expected a file that this user may read and write", path.display())
            }
            Self::NotOwn { path, why } => write!(
                f,
                "{}: {why}; a simulated machine is a file of this user alone: remove it, or choose another --name",
                path.display()
            ),
            Self::NotAMachine { path } => write!(
                f,
                "{}: not a simulated machine of this version; remove it and start `specgen plant` of the specgen that made this controller",
                path.display()
            ),
            Self::OtherSpec { path, found } => write!(
                f,
                "{}: the machine of another spec (digest {found}…); start `specgen plant` with the spec of this controller",
                path.display()
            ),
            Self::Served { path, process } => write!(
                f,
                "{}: process {process} serves a machine of this name; end it, or choose another --name",
                path.display()
            ),
        }
    }
}

impl std::error::Error for OpenError {}

impl OpenError {
    fn of(unfit: MapError, path: &Path) -> Self {
        let path = path.to_owned();
        match unfit {
            MapError::NotOwn(why) => Self::NotOwn { path, why },
            MapError::Size => Self::NotAMachine { path },
            MapError::File(cause) => Self::File { path, cause },
        }
    }
}

/// The file of a machine's name. Names are of letters, digits, `-` and `_`.
///
/// # Errors
/// If the name has other characters; states what is expected.
pub fn path_of(name: &str) -> Result<PathBuf, String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 64 || !name.chars().all(fits) {
        return Err(format!("expected a name of at most 64 letters, digits, `-` and `_`, found `{name}`"));
    }
    Ok(Path::new("/dev/shm").join(format!("specgen-plant-{name}")))
}

/// First half of a SHA-256 in hex as two words; 0 for invalid hex.
fn half_digest(digest: &str) -> [u64; 2] {
    [0, 16].map(|at| digest.get(at..at + 16).and_then(|part| u64::from_str_radix(part, 16).ok()).unwrap_or(0))
}

/// The machine's end.
pub struct Server {
    mapping: Mapping<SharedWords>,
    path: PathBuf,
}

/// The controller's end.
pub struct Client {
    mapping: Mapping<SharedWords>,
    session: u64,
}

impl Server {
    /// Creates the file, for the machine of the spec with `digest` (SHA-256 in hex). It is removed when this is
    /// dropped.
    ///
    /// # Errors
    /// If a machine of this name is being served, the name belongs to another user's file, or the file cannot be
    /// created.
    pub fn create(path: &Path, digest: &str) -> Result<Self, OpenError> {
        let failed = |cause| OpenError::File { path: path.to_owned(), cause };
        match Mapping::<SharedWords>::open(path) {
            Ok(old) => {
                let process = old.words().server.load(Ordering::Acquire);
                if old.words().magic.load(Ordering::Acquire) == MAGIC && process != 0 && is_alive(process) {
                    return Err(OpenError::Served { path: path.to_owned(), process });
                }
            }
            // Left over from another version, or by an interrupted start.
            Err(MapError::Size) => {}
            Err(MapError::File(cause)) if cause.kind() == io::ErrorKind::NotFound => {}
            Err(unfit) => return Err(OpenError::of(unfit, path)),
        }
        let (mapping, fresh) = Self::fresh(path)?;
        let words = mapping.words();
        words.version.store(VERSION, Ordering::Relaxed);
        for (word, half) in words.digest.iter().zip(half_digest(digest)) {
            word.store(half, Ordering::Relaxed);
        }
        words.server.store(u64::from(std::process::id()), Ordering::Relaxed);
        words.magic.store(MAGIC, Ordering::Release);
        std::fs::rename(&fresh, path).map_err(|cause| {
            let _ = std::fs::remove_file(&fresh);
            failed(cause)
        })?;
        Ok(Self { mapping, path: path.to_owned() })
    }

    /// A new file, created under another name and then renamed: nobody maps an incomplete file, and a process that maps
    /// an old one keeps it.
    fn fresh(path: &Path) -> Result<(Mapping<SharedWords>, PathBuf), OpenError> {
        let fresh = path.with_extension(format!("{}.part", std::process::id()));
        let failed = |cause| OpenError::File { path: fresh.clone(), cause };
        match Mapping::create(&fresh) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|mapping| (mapping, fresh.clone())).map_err(failed),
        }
        // Left over from a killed process with this number, if it belongs to this user.
        match Mapping::<SharedWords>::open(&fresh) {
            Ok(_) | Err(MapError::Size) => std::fs::remove_file(&fresh).map_err(failed)?,
            Err(unfit) => return Err(OpenError::of(unfit, &fresh)),
        }
        Mapping::create(&fresh).map(|mapping| (mapping, fresh.clone())).map_err(failed)
    }

    /// The latest actuation and the requested sensing (session, tick), once the counter of either differs from `seen`;
    /// none after `timeout` (ns). It polls for `look` (ns) before it sleeps.
    #[must_use]
    pub fn wait(&self, seen: &mut u32, look: u64, timeout: u64) -> Option<(Actuation, [u64; 2])> {
        self.mapping.words().wait(seen, look, timeout)
    }

    /// Whether the memory is lost: the file was truncated, or its magic word overwritten. The controller cannot be
    /// heard any more.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.mapping.words().magic.load(Ordering::Acquire) != MAGIC
    }

    /// Gives a reading out.
    pub fn publish(&self, sensing: &Sensing) {
        self.mapping.words().publish(sensing);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.mapping.words().server.store(0, Ordering::Release);
        let _ = std::fs::remove_file(&self.path);
    }
}

impl Client {
    /// Opens the machine of the spec with `digest` (SHA-256 in hex).
    ///
    /// # Errors
    /// If there is none, or it belongs to another spec.
    pub fn open(path: &Path, digest: &str) -> Result<Self, OpenError> {
        let mapping = Mapping::<SharedWords>::open(path).map_err(|unfit| OpenError::of(unfit, path))?;
        let words = mapping.words();
        if words.magic.load(Ordering::Acquire) != MAGIC || words.version.load(Ordering::Relaxed) != VERSION {
            return Err(OpenError::NotAMachine { path: path.to_owned() });
        }
        let found = [0, 1].map(|k| words.digest[k].load(Ordering::Relaxed));
        if found != half_digest(digest) {
            let found = format!("{:016x}", found[0]);
            return Err(OpenError::OtherSpec { path: path.to_owned(), found });
        }
        // Ticks start at 0 again; the session shows the machine that it is another run.
        let session = clock::now() ^ (u64::from(std::process::id()) << 40);
        Ok(Self { mapping, session })
    }

    /// The reading at the beginning of `tick`; none if the machine does not publish it within `timeout` (ns).
    #[must_use]
    pub fn sense(&self, tick: u64, timeout: u64) -> Option<Sensing> {
        self.mapping.words().sense(self.session, tick, timeout)
    }

    /// Publishes codes for the interval that begins with `tick`.
    pub fn actuate(&self, tick: u64, enable: bool, codes: &[i32; CHANNELS]) {
        self.mapping.words().actuate(self.session, tick, enable, codes);
    }

    /// Whether the machine's process has ended, normally or not.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        let process = self.mapping.words().server.load(Ordering::Acquire);
        process == 0 || !is_alive(process)
    }
}

fn is_alive(process: u64) -> bool {
    Path::new("/proc").join(process.to_string()).exists()
}

#[cfg(test)]
mod tests;
