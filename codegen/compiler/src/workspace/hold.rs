//! Exclusive use of an output folder: its work folder with a lock that is released when the process ends, for any reason.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::error::WriteError;
use specgen_language::interrupt::{self, Guard, ResultFolders};
use specgen_language::lock;

/// The lock file in the work folder. It contains the name of the owner.
const LOCK: &str = "lock";
/// Time to wait for another run: a run that only writes has finished by then.
const TIMEOUT: Duration = Duration::from_secs(5);
const ROUND: Duration = Duration::from_millis(20);

/// The right to write an output folder and to build in it, until this is dropped.
#[derive(Debug)]
pub struct Hold {
    work: PathBuf,
    _file: File,
    // An interrupt also removes it.
    _lock: Guard,
    _made: ResultFolders,
}

impl Hold {
    /// Creates `work`, the work folder of `dir`, or takes over that of a killed run.
    pub(super) fn take(work: &Path, dir: &Path) -> Result<Self, WriteError> {
        let start = Instant::now();
        loop {
            match Self::attempt(work) {
                Ok(hold) => return Ok(hold),
                // Another run has it, or has just removed it.
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::NotFound) => {}
                Err(error) => return Err(WriteError::io("write", dir, error)),
            }
            if start.elapsed() > TIMEOUT {
                return Err(WriteError::Busy { dir: dir.to_owned(), owner: owner(&work.join(LOCK)) });
            }
            std::thread::sleep(ROUND);
        }
    }

    fn attempt(work: &Path) -> io::Result<Self> {
        let made = ResultFolders::new(work)?;
        check_own(work)?;
        let path = work.join(LOCK);
        let (mut file, lock) = Guard::file(|| lock::make(&path), |_| path.clone())?;
        let owner = format!("process {} (`{}`)\n", std::process::id(), command());
        // The lock works without a name, too.
        let _ = file.set_len(0).and_then(|()| file.write_all(owner.as_bytes()));
        Ok(Self { work: work.to_owned(), _file: file, _lock: lock, _made: made })
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        let _whole = interrupt::whole();
        // Before the lock is released, so that a waiting run sees that the file is no longer the one in the folder.
        let _ = fs::remove_file(self.work.join(LOCK));
        // The next run takes over a folder that is not empty.
        let _ = fs::remove_dir(&self.work);
    }
}

/// Checks that the work folder belongs to this user: its contents are moved into the output.
fn check_own(work: &Path) -> io::Result<()> {
    let found = fs::symlink_metadata(work)?;
    let refused = |kind, what: &str| Err(io::Error::new(kind, format!("`{}` is {what}", work.display())));
    match (found.is_dir(), lock::is_own(&found)) {
        (true, true) => Ok(()),
        (false, _) => refused(io::ErrorKind::NotADirectory, "not a folder, but specgen needs it as its work folder"),
        (true, false) => refused(io::ErrorKind::PermissionDenied, "owned by another user"),
    }
}

fn command() -> String {
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    words.join(" ")
}

fn owner(lock: &Path) -> String {
    let text = fs::read_to_string(lock).unwrap_or_default();
    let line: String = text.lines().next().unwrap_or_default().chars().filter(|c| !c.is_control()).take(300).collect();
    if line.is_empty() { "another run of specgen".to_owned() } else { line }
}
