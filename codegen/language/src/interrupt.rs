//! Ctrl-C, SIGTERM and a closed terminal: partial output is removed, then the process ends.
//!
//! A command with intermediate results, or with a running machine to stop, calls [`heed`] to be notified instead, and
//! ends by itself.

use std::cell::Cell;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use tempfile::TempDir;

use crate::lock;

static PRESSED: AtomicBool = AtomicBool::new(false);
thread_local! {
    /// Replaces [`PRESSED`] and [`HEEDED`] for the command of this thread.
    static OWN: Cell<Option<(&'static AtomicBool, bool)>> = const { Cell::new(None) };
}
static HEEDED: AtomicBool = AtomicBool::new(false);
/// Held during operations that must not be interrupted.
static WHOLE: Mutex<()> = Mutex::new(());
/// Temporary objects, in the order of their creation.
static PASSING: Mutex<Vec<TemporaryPath>> = Mutex::new(Vec::new());

/// Removed at the end, however the process ends.
#[derive(Debug, Clone, PartialEq, Eq)]
enum TemporaryPath {
    /// With its content.
    Tree(PathBuf),
    File(PathBuf),
    /// Only if it is empty.
    EmptyFolder(PathBuf),
}

impl TemporaryPath {
    /// Whether it is a folder with content that is there.
    fn is_tree(&self) -> bool {
        matches!(self, Self::Tree(path) if path.exists())
    }

    fn remove(&self) -> io::Result<()> {
        match self {
            Self::Tree(path) => fs::remove_dir_all(path),
            Self::File(path) => fs::remove_file(path),
            Self::EmptyFolder(path) => fs::remove_dir(path),
        }
    }
}

/// From now on an interrupt removes temporary objects, calls `end`, which reports it, and ends the process with the
/// exit code that `end` returns.
pub fn catch(end: impl Fn() -> u8 + Send + 'static) {
    // Without a handler an interrupt still ends the process, but leaves temporary folders.
    let Ok(mut signals) = Signals::new([SIGHUP, SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        for _ in signals.forever() {
            PRESSED.store(true, Ordering::SeqCst);
            if !HEEDED.load(Ordering::SeqCst) {
                leave(&end);
            }
        }
    });
}

/// Removes temporary objects and ends the process.
fn leave(end: &impl Fn() -> u8) -> ! {
    let _whole = whole();
    let passing = locked(&PASSING);
    for one in passing.iter().rev() {
        // A compiler that was interrupted as well may still be writing or removing its last files.
        for _ in 0..100 {
            if one.remove().is_ok() || !one.is_tree() {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    // A thread of the command may make a folder again that it was about to fill. It ends at the next file that it misses.
    for _ in 0..100 {
        std::thread::sleep(Duration::from_millis(20));
        let back: Vec<_> = passing.iter().rev().filter(|one| one.is_tree()).collect();
        if back.is_empty() {
            break;
        }
        // Tried again in the next round.
        back.into_iter().for_each(|one| drop(one.remove()));
    }
    std::process::exit(i32::from(end()));
}

/// From now on an interrupt only sets the returned flag; the command checks it and ends by itself. A second interrupt
/// has no effect.
pub fn heed() -> &'static AtomicBool {
    if let Some((stop, _)) = OWN.get() {
        OWN.set(Some((stop, true)));
        return stop;
    }
    HEEDED.store(true, Ordering::SeqCst);
    &PRESSED
}

/// From now on only `stop`, which the caller sets, interrupts a command in this thread. For programs that call a
/// command as a function.
pub fn own(stop: &'static AtomicBool) {
    OWN.set(Some((stop, false)));
}

/// Payload of the unwinding of a command that its caller interrupted.
#[derive(Debug)]
pub struct Interruption;

/// Unwinds with [`Interruption`] if the caller has interrupted the command of this thread and the command does not use
/// [`heed`].
pub fn point() {
    if OWN.get().is_some_and(|(stop, heeded)| !heeded && stop.load(Ordering::SeqCst)) {
        std::panic::resume_unwind(Box::new(Interruption));
    }
}

/// Waits for the end if an interrupt is about to end the process: a failure in the meantime was caused by it, for
/// example in a compiler that got the interrupt first.
pub fn settle() {
    std::thread::sleep(Duration::from_millis(50));
    while PRESSED.load(Ordering::SeqCst) && !HEEDED.load(Ordering::SeqCst) {
        std::thread::park_timeout(Duration::from_secs(1));
    }
}

/// While this is held, no interrupt ends the process. For short operations only.
pub fn whole() -> MutexGuard<'static, ()> {
    locked(&WHOLE)
}

fn locked<T>(mutex: &'static Mutex<T>) -> MutexGuard<'static, T> {
    // A thread that panicked with the lock left a complete list.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registers an object that an interrupt must remove. Dropped when it is gone, or belongs to another process.
#[derive(Debug)]
pub struct Guard(TemporaryPath);

impl Guard {
    fn of(passing: TemporaryPath) -> Self {
        locked(&PASSING).push(passing.clone());
        Self(passing)
    }

    /// For a file that `make` creates.
    ///
    /// # Errors
    /// What `make` says.
    pub fn file<T>(make: impl FnOnce() -> io::Result<T>, path: impl Fn(&T) -> PathBuf) -> io::Result<(T, Self)> {
        let _whole = whole();
        let made = make()?;
        let guard = Self::of(TemporaryPath::File(path(&made)));
        Ok((made, guard))
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        let mut passing = locked(&PASSING);
        if let Some(index) = passing.iter().rposition(|one| *one == self.0) {
            passing.remove(index);
        }
    }
}

/// A temporary folder, removed when this is dropped or the process is interrupted.
#[derive(Debug)]
pub struct Scratch {
    folder: TempDir,
    // Dropped after the folder: it stays registered and locked until it is removed.
    _guard: Guard,
    _lock: Option<File>,
}

/// Prefix of temporary folders.
const SCRATCH: &str = "specgen-scratch-";

impl Scratch {
    /// A new empty folder.
    ///
    /// # Errors
    /// The error of the file system.
    pub fn new() -> io::Result<Self> {
        Self::below(&std::env::temp_dir())
    }

    /// A new empty folder in `folder` instead of the system's, so that its content can be renamed to its destination
    /// there.
    ///
    /// # Errors
    /// The error of the file system.
    pub fn below(folder: &Path) -> io::Result<Self> {
        // Left by processes that were killed.
        lock::sweep(folder, SCRATCH);
        let _whole = whole();
        loop {
            let folder = tempfile::Builder::new().prefix(SCRATCH).tempdir_in(folder)?;
            let lock = match File::open(folder.path()).and_then(|file| lock::of(file, folder.path())) {
                Ok(lock) => Some(lock),
                // Another process took it for an abandoned one.
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::NotFound) => continue,
                // Where folders cannot be locked, none is swept.
                Err(_) => None,
            };
            let guard = Guard::of(TemporaryPath::Tree(folder.path().to_owned()));
            return Ok(Self { folder, _guard: guard, _lock: lock });
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Folders made for results; those that are still empty at the end are removed.
#[derive(Debug)]
pub struct ResultFolders(Vec<Guard>);

impl ResultFolders {
    /// Makes `folder` and its missing parents.
    ///
    /// # Errors
    /// The error of the file system; nothing was made then.
    pub fn new(folder: &Path) -> io::Result<Self> {
        let is_missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let mut missing: Vec<&Path> = folder.ancestors().take_while(is_missing).collect();
        missing.reverse();
        let mut claimed = Self(Vec::new());
        for path in missing {
            let _whole = whole();
            if make_folder(path)? {
                claimed.0.push(Guard::of(TemporaryPath::EmptyFolder(path.to_owned())));
            }
        }
        // Another run may have removed it in the meantime. If it is there and not a folder, the attempt shows it.
        let _whole = whole();
        if !folder.is_dir() && make_folder(folder)? {
            claimed.0.push(Guard::of(TemporaryPath::EmptyFolder(folder.to_owned())));
        }
        Ok(claimed)
    }
}

/// Makes a folder; false if it exists by now.
fn make_folder(path: &Path) -> io::Result<bool> {
    loop {
        match fs::create_dir(path) {
            Ok(()) => return Ok(true),
            Err(_) if path.is_dir() => return Ok(false),
            // It existed, and another process has just removed it, or has made it once more.
            Err(error)
                if error.kind() == io::ErrorKind::AlreadyExists
                    && fs::symlink_metadata(path).map_or(true, |there| there.is_dir()) => {}
            Err(error) => return Err(error),
        }
    }
}

impl Drop for ResultFolders {
    fn drop(&mut self) {
        while let Some(guard) = self.0.pop() {
            // A folder with content stays.
            let _ = guard.0.remove();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passing(path: &Path) -> usize {
        let is_of = |one: &&TemporaryPath| matches!(one, TemporaryPath::Tree(p) | TemporaryPath::File(p) | TemporaryPath::EmptyFolder(p) if p == path);
        locked(&PASSING).iter().filter(is_of).count()
    }

    #[test]
    fn a_scratch_folder_is_kept_in_mind_until_it_is_gone() {
        let scratch = Scratch::new().unwrap();
        let path = scratch.path().to_owned();
        fs::write(path.join("half"), "x").unwrap();
        assert_eq!((passing(&path), path.is_dir()), (1, true));
        drop(scratch);
        assert_eq!((passing(&path), path.exists()), (0, false));
    }

    /// Simulates another run of specgen: within one process the second waits for the first.
    #[test]
    fn a_folder_that_goes_while_it_is_made_is_made_again() {
        let scratch = Scratch::new().unwrap();
        let folder = scratch.path().join("work");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..1000 {
                        make_folder(&folder).unwrap();
                        let _ = fs::remove_dir(&folder);
                    }
                });
            }
        });
        // A permanent obstacle is an error, and no reason to wait.
        std::os::unix::fs::symlink("nowhere", &folder).unwrap();
        assert_eq!(make_folder(&folder).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    }

    #[test]
    fn a_command_of_a_thread_has_an_interrupt_of_its_own() {
        let [first, second] = [(); 2].map(|()| &*Box::leak(Box::new(AtomicBool::new(false))));
        let is_ended = || std::panic::catch_unwind(point).is_err_and(|cause| cause.is::<Interruption>());
        own(first);
        assert!(!is_ended());
        first.store(true, Ordering::SeqCst);
        assert!(is_ended() && !std::thread::spawn(is_ended).join().unwrap());
        // A command that heeds it ends by itself; the next command starts afresh.
        assert!(std::ptr::eq(heed(), first) && !is_ended());
        assert!(!PRESSED.load(Ordering::SeqCst) && !HEEDED.load(Ordering::SeqCst));
        own(second);
        assert!(!is_ended());
    }

    #[test]
    fn claimed_folders_stay_if_something_is_in_them() {
        let scratch = Scratch::new().unwrap();
        let inner = scratch.path().join("a/b");
        drop(ResultFolders::new(&inner).unwrap());
        assert!(!scratch.path().join("a").exists());
        let claimed = ResultFolders::new(&inner).unwrap();
        fs::write(inner.join("result"), "x").unwrap();
        drop(claimed);
        assert!(inner.join("result").is_file());
        // A folder that existed before is not removed.
        fs::create_dir(scratch.path().join("old")).unwrap();
        drop(ResultFolders::new(&scratch.path().join("old")).unwrap());
        assert!(scratch.path().join("old").is_dir());
        assert!(ResultFolders::new(&inner.join("result")).is_err());
        assert!(ResultFolders::new(&inner.join("result/below")).is_err());
    }
}
