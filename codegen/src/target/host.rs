//! Builds DIR/host of an emitted workspace into a shared library for this machine.

use super::build::{BuildRequest, cargo_artifact};
use super::error::TargetError;
use super::process::{clean_command, find_in_path};
use crate::interrupt;
use std::path::{Path, PathBuf};

/// A shared library may leave symbols undefined unless told otherwise, and then the proof that nothing can
/// panic would never fail. libc is for `memcpy` and `memset`, which the compiler calls by itself.
const LINK: [&str; 2] = ["-Clink-arg=-Wl,-z,defs", "-Clink-arg=-lc"];

/// Builds `dir/host` (a `cdylib` that links only if nothing in it can panic) and returns the library's path.
///
/// `target_dir` keeps what can be used again. The library is copied to a name that holds a digest of its
/// content, so that a later build into the same folder cannot change what the path means.
///
/// # Errors
/// [`TargetError::MissingTool`] without cargo, [`TargetError::PanicPath`] if the controller can panic,
/// [`TargetError::BuildFailed`] for everything else that cargo says.
pub fn build_library(dir: &Path, target_dir: &Path) -> Result<PathBuf, TargetError> {
    let cargo = cargo()?;
    let package = dir.join("host");
    let target_dir = target_dir.join("host");
    let mut command = clean_command(cargo);
    // `cargo rustc`, so that the link flags below reach this crate alone.
    command.args(["rustc", "--release", "--lib"]);
    let request = BuildRequest { package: &package, target_dir: &target_dir, rustc_args: &LINK, locked: false };
    let library = cargo_artifact(&mut command, &request, &package.display().to_string(), |message| {
        let is_library = message["target"]["kind"].as_array()?.iter().any(|kind| kind == "cdylib");
        let file = message["filenames"].as_array()?.first()?.as_str()?;
        is_library.then(|| PathBuf::from(file))
    })?;
    keep(&library.path, &library.bytes)
}

/// Builds the program in `dir/folder` for this machine and returns its path. Its dependencies are those of its lock file.
///
/// # Errors
/// [`TargetError::MissingTool`] without cargo, [`TargetError::BuildFailed`] for everything that cargo says.
pub fn build_program(dir: &Path, folder: &str, target_dir: &Path) -> Result<PathBuf, TargetError> {
    let package = dir.join(folder);
    let target_dir = target_dir.join(folder);
    let mut command = clean_command(cargo()?);
    command.args(["build", "--release"]);
    let request = BuildRequest { package: &package, target_dir: &target_dir, rustc_args: &[], locked: true };
    let program = cargo_artifact(&mut command, &request, &package.display().to_string(), |message| {
        message["executable"].as_str().map(PathBuf::from)
    })?;
    Ok(program.path)
}

/// The cargo of this machine.
fn cargo() -> Result<PathBuf, TargetError> {
    find_in_path("cargo").ok_or_else(|| TargetError::MissingTool {
        tool: "cargo".into(),
        looked: "cargo on PATH".into(),
        command: "the commands at rustup.rs   (or, on Debian: apt-get install cargo-web)".into(),
    })
}

/// Copies the library to a name that only this content has.
fn keep(built: &Path, bytes: &[u8]) -> Result<PathBuf, TargetError> {
    use sha2::{Digest, Sha256};
    use std::fmt::Write;

    let mut name = String::new();
    for byte in &Sha256::digest(bytes)[..8] {
        // Writing to a String cannot fail.
        let _ = write!(name, "{byte:02x}");
    }
    let kept = built.with_file_name(format!("specgen-{name}{}", std::env::consts::DLL_SUFFIX));
    if !kept.is_file() {
        write_whole(&kept, bytes)?;
    }
    Ok(kept)
}

/// Writes a file beside its place and renames it, so that nobody finds half of it.
///
/// # Errors
/// [`TargetError::Io`]; nothing is left then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), TargetError> {
    let _whole = interrupt::whole();
    let partial = path.with_extension(format!("{}.part", std::process::id()));
    let written = std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path));
    written.map_err(|error| {
        let _ = std::fs::remove_file(&partial);
        TargetError::io("writing", path, error)
    })
}
