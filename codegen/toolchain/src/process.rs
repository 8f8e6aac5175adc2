//! Runs other programs: with captured output, a time limit, and without the environment of an outer cargo.

use std::ffi::OsStr;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Output and exit status of a program.
pub struct ProgramOutput {
    /// `None` if it was stopped at the time limit.
    pub status: Option<ExitStatus>,
    /// Standard output, with anything that is not UTF-8 replaced.
    pub stdout: String,
    /// Standard error, likewise.
    pub stderr: String,
}

impl ProgramOutput {
    /// True if it exited by itself with success.
    pub fn success(&self) -> bool {
        self.status.is_some_and(|status| status.success())
    }
}

/// Prefixes of variables that change what cargo builds: `cargo test` sets some of them, users set others.
/// The same spec must give the same bytes, so builds see none of them.
const LEAKS: [&str; 19] = [
    "RUSTC",
    "RUSTDOC",
    "RUSTFLAGS",
    "CARGO_BIN_",
    "CARGO_BUILD_",
    "CARGO_CFG_",
    "CARGO_CRATE_NAME",
    "CARGO_ENCODED_",
    "CARGO_FEATURE_",
    "CARGO_INCREMENTAL",
    "CARGO_MANIFEST_",
    "CARGO_PKG_",
    "CARGO_PRIMARY_PACKAGE",
    "CARGO_PROFILE_",
    "CARGO_TARGET_",
    "CARGO_UNSTABLE_",
    "__CARGO",
    // For build scripts.
    "DEFMT_",
    "SPECGEN_LOCATE_PANICS",
];
/// Points into the outer toolchain; another compiler would load the wrong libraries.
const LIBRARIES: &str = "LD_LIBRARY_PATH";
/// The number of parallel jobs does not affect the output.
const JOBS: &str = "CARGO_BUILD_JOBS";
/// Some machines cannot link without these.
const LINKING: [&str; 6] =
    ["COMPILER_PATH", "GCC_EXEC_PREFIX", "LIBRARY_PATH", "LD_RUN_PATH", "MACOSX_DEPLOYMENT_TARGET", "SDKROOT"];

/// Whether a build sees this variable and its output may depend on it.
pub fn decides_on_link(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    // `toolchain` chooses the linker of an image.
    let of_target = name.starts_with("CARGO_TARGET_") && name.ends_with("_LINKER") && !name.contains("THUMB");
    of_target || LINKING.contains(&&*name)
}

fn leaks(name: &OsStr) -> bool {
    let text = name.to_string_lossy();
    text == LIBRARIES || LEAKS.iter().any(|leak| text.starts_with(leak)) && text != JOBS && !decides_on_link(name)
}

/// A command without the outer cargo's variables and the caller's wrappers and flags. Crate sources and toolchain selection
/// remain the caller's choice.
pub fn clean_command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    for (name, _) in std::env::vars_os().filter(|(name, _)| leaks(name)) {
        command.env_remove(name);
    }
    command
}

/// Adds library folders for the program; no change if there are none.
pub fn with_libraries<'a>(command: &'a mut Command, folders: &[PathBuf]) -> &'a mut Command {
    // The loader could not find a folder whose name cannot be part of a list.
    if let Some(list) = std::env::join_paths(folders).ok().filter(|_| !folders.is_empty()) {
        command.env("LD_LIBRARY_PATH", list);
    }
    command
}

/// Runs a program until it exits or the time limit expires. Its output goes to two files in `scratch`: a full pipe
/// would block the program.
pub fn run(command: &mut Command, scratch: &Path, limit: Duration) -> io::Result<ProgramOutput> {
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
    Ok(ProgramOutput { status, stdout: read(&out)?, stderr: read(&err)? })
}

/// The first file of that name in the folders of `PATH`.
pub fn find_in_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
}

/// First line of the program's output, or `None` if it cannot be run or fails.
pub fn first_line(command: &mut Command) -> Option<String> {
    Some(printed(command)?.lines().next().unwrap_or_default().trim().to_owned())
}

/// The program's output, or `None` if it cannot be run or fails.
pub fn printed(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_that_change_a_build_are_removed_and_others_kept() {
        for name in [
            "RUSTFLAGS",
            "RUSTC_WRAPPER",
            "CARGO_ENCODED_RUSTFLAGS",
            "CARGO_PROFILE_RELEASE_OPT_LEVEL",
            "CARGO_BUILD_RUSTFLAGS",
            "CARGO_TARGET_DIR",
            "CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUSTFLAGS",
            "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER",
            "CARGO_INCREMENTAL",
            "SPECGEN_LOCATE_PANICS",
            "LD_LIBRARY_PATH",
        ] {
            assert!(leaks(OsStr::new(name)) && !decides_on_link(OsStr::new(name)), "{name}");
        }
        for name in [
            "PATH",
            "CARGO_HOME",
            "CARGO_HTTP_PROXY",
            "CARGO_REGISTRIES_A_TOKEN",
            "CARGO_BUILD_JOBS",
            "RUSTUP_TOOLCHAIN",
        ] {
            assert!(!leaks(OsStr::new(name)) && !decides_on_link(OsStr::new(name)), "{name}");
        }
        for name in ["CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_LINKER", "LIBRARY_PATH"] {
            assert!(!leaks(OsStr::new(name)) && decides_on_link(OsStr::new(name)), "{name}");
        }
    }
}
