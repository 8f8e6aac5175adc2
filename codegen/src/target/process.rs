//! Running other programs: captured, with a time limit, free of the environment of an outer cargo.

use std::ffi::OsStr;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// What a program printed and how it ended.
pub struct Finished {
    /// `None` if it was ended at the time limit.
    pub status: Option<ExitStatus>,
    /// Standard output, with anything that is not UTF-8 replaced.
    pub stdout: String,
    /// Standard error, likewise.
    pub stderr: String,
}

impl Finished {
    /// It ended by itself and says that all is well.
    pub fn success(&self) -> bool {
        self.status.is_some_and(|status| status.success())
    }
}

/// A command that no outer cargo, rustc wrapper or flag of the caller's environment leaks into.
///
/// `cargo test` sets variables that change what a cargo inside it builds.
pub fn clean_command(program: impl AsRef<OsStr>) -> Command {
    const LEAKS: [&str; 14] = [
        "RUSTC",
        "RUSTC_WRAPPER",
        "RUSTC_WORKSPACE_WRAPPER",
        "RUSTC_BOOTSTRAP",
        "RUSTFLAGS",
        "RUSTDOCFLAGS",
        "CARGO_ENCODED_RUSTFLAGS",
        "CARGO_BUILD_TARGET",
        "CARGO_BUILD_RUSTFLAGS",
        "CARGO_TARGET_DIR",
        "CARGO_BUILD_TARGET_DIR",
        "CARGO_MANIFEST_DIR",
        "CARGO_PKG_NAME",
        // Points into the outer toolchain; another compiler would load that one's libraries.
        "LD_LIBRARY_PATH",
    ];
    let mut command = Command::new(program);
    for name in LEAKS {
        command.env_remove(name);
    }
    command
}

/// Lets the program find libraries in these folders; in none, nothing is changed.
pub fn with_libraries<'a>(command: &'a mut Command, folders: &[PathBuf]) -> &'a mut Command {
    // A folder whose name cannot stand in a list would not be found by the loader either.
    if let Some(list) = std::env::join_paths(folders).ok().filter(|_| !folders.is_empty()) {
        command.env("LD_LIBRARY_PATH", list);
    }
    command
}

/// Runs to the end, or to the limit, with what it prints going to two files in `scratch`: a pipe
/// that nobody empties would stop the program.
pub fn run(command: &mut Command, scratch: &Path, limit: Duration) -> io::Result<Finished> {
    let out = scratch.join("specgen-stdout.txt");
    let err = scratch.join("specgen-stderr.txt");
    command.stdin(Stdio::null()).stdout(File::create(&out)?).stderr(File::create(&err)?);
    let mut child = command.spawn()?;
    let start = Instant::now();
    let mut pause = Duration::from_millis(1);
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        if start.elapsed() >= limit {
            child.kill()?;
            child.wait()?;
            break None;
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(50));
    };
    let read = |path: &Path| std::fs::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    Ok(Finished { status, stdout: read(&out)?, stderr: read(&err)? })
}

/// The first file of that name in the folders of `PATH`.
pub fn find_in_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
}

/// First line that the program prints, or `None` if it cannot be run or fails.
pub fn first_line(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    if !output.status.success() {
        return None;
    }
    let text = String::from_utf8_lossy(&output.stdout);
    Some(text.lines().next().unwrap_or_default().trim().to_owned())
}
