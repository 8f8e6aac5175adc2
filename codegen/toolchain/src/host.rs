//! Builds `DIR/host` of an emitted workspace into a shared library for this machine.

use super::build::{BuildRequest, cargo_artifact};
use super::cache;
use super::error::TargetError;
use super::process::{clean_command, find_in_path};
use crate::sha256;
use std::path::{Path, PathBuf};

/// By default a shared library may leave symbols undefined, and then the panic check would never fail.
/// libc provides `memcpy` and `memset`, which the compiler calls implicitly.
const LINK: [&str; 2] = ["-Clink-arg=-Wl,-z,defs", "-Clink-arg=-lc"];

/// Without link-time optimisation: the controller's crate already contains the runtime code that it uses, and a second pass doubles
/// the build time. A user's own build uses LTO, by the profile of the emitted workspace.
const PROFILE: [(&str, &str); 2] = [("CARGO_PROFILE_RELEASE_LTO", "off"), ("CARGO_PROFILE_RELEASE_DEBUG", "0")];

/// Builds `dir/host` (a `cdylib` that links only if nothing in it can panic) and returns the library's path.
///
/// `target_dir` holds reusable build products. The library is copied to a name that contains a digest of its
/// content, so that a later build cannot change what the path means.
///
/// # Errors
/// [`TargetError::MissingTool`] without cargo, [`TargetError::PanicPath`] if the controller can panic,
/// [`TargetError::BuildFailed`] for any other error of cargo.
pub fn build_library(dir: &Path, target_dir: &Path) -> Result<PathBuf, TargetError> {
    let cargo = cargo()?;
    let package = dir.join("host");
    let target_dir = target_dir.join("host");
    let mut command = clean_command(cargo);
    // `cargo rustc`, so that the link flags below apply to this crate only.
    command.envs(PROFILE).args(["rustc", "--release", "--lib"]);
    let request = BuildRequest { package: &package, target_dir: &target_dir, rustc_args: &LINK, locked: false };
    let library = cargo_artifact(&mut command, &request, &package.display().to_string(), |message| {
        let is_library = message["target"]["kind"].as_array()?.iter().any(|kind| kind == "cdylib");
        let file = message["filenames"].as_array()?.first()?.as_str()?;
        is_library.then(|| PathBuf::from(file))
    })?;
    keep(&library.path, &library.bytes)
}

/// [`build_library`] for a library to be loaded into this process.
///
/// # Errors
/// As [`build_library`]; [`TargetError::Static`], before building anything, if this process cannot load a library.
pub fn build_loadable(dir: &Path, target_dir: &Path) -> Result<PathBuf, TargetError> {
    refuse_static()?;
    build_library(dir, target_dir)
}

/// A static musl program has no loader.
fn refuse_static() -> Result<(), TargetError> {
    if cfg!(all(target_env = "musl", target_feature = "crt-static")) { Err(TargetError::Static) } else { Ok(()) }
}

/// Builds the program in `dir/folder` for this machine and returns its path. Dependencies come from its lock file.
///
/// # Errors
/// [`TargetError::MissingTool`] without cargo, [`TargetError::BuildFailed`] for any error of cargo.
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

/// Builds `sources/fmu.c` together with the static library of `package` into one shared library, `target_dir/NAME` with the
/// extension of this host, and returns its path. It exports none of the package's symbols, so a process may load several.
/// Dependencies come from the lock file beside its folder, if there is one.
///
/// # Errors
/// [`TargetError::MissingTool`] without cargo or a C compiler, [`TargetError::PanicPath`] if the controller can panic,
/// [`TargetError::BuildFailed`] for any other error of these tools.
pub fn build_unit(sources: &Path, package: &Path, target_dir: &Path, name: &str) -> Result<PathBuf, TargetError> {
    let mut command = clean_command(cargo()?);
    command.envs(PROFILE).args(["rustc", "--release", "--lib", "--crate-type", "staticlib"]);
    let locked = package.with_file_name("Cargo.lock").is_file();
    let request = BuildRequest { package, target_dir: &target_dir.join("unit"), rustc_args: &[], locked };
    let archive = cargo_artifact(&mut command, &request, &package.display().to_string(), |message| {
        let files = message["filenames"].as_array()?.iter().filter_map(|file| file.as_str());
        files.map(PathBuf::from).find(|file| file.extension().is_some_and(|extension| extension == "a"))
    })?;
    let compiler = find_in_path("cc").ok_or_else(|| TargetError::MissingTool {
        tool: "cc".into(),
        looked: "cc on PATH".into(),
        command: "apt-get install gcc libc6-dev".into(),
    })?;
    let library = target_dir.join(format!("{name}{}", std::env::consts::DLL_SUFFIX));
    let mut command = clean_command(compiler);
    command.args(["-std=c11", "-O2", "-Wall", "-Wextra", "-fPIC", "-fvisibility=hidden", "-shared"]);
    command.arg(sources.join("fmu.c")).arg(&archive.path).arg("-o").arg(&library);
    if cfg!(target_os = "linux") {
        // With no undefined symbols allowed, a call of the panic handler does not link.
        command.args(["-Wl,-z,defs", "-Wl,--gc-sections", "-Wl,--exclude-libs,ALL", "-lm", "-lpthread", "-ldl", "-lc"]);
    }
    let what = sources.join("fmu.c").display().to_string();
    let done = command.output().map_err(|error| TargetError::io("running cc on", sources.join("fmu.c"), error))?;
    if done.status.success() {
        return Ok(library);
    }
    let text = String::from_utf8_lossy(&done.stderr).into_owned();
    Err(if text.contains("specgen_panic_path_remains") {
        TargetError::PanicPath { what, text }
    } else {
        TargetError::BuildFailed { what, text }
    })
}

fn cargo() -> Result<PathBuf, TargetError> {
    find_in_path("cargo").ok_or_else(|| TargetError::MissingTool {
        tool: "cargo".into(),
        looked: "cargo on PATH".into(),
        command: "the commands at rustup.rs   (or, on Debian: apt-get install cargo-web)".into(),
    })
}

/// Copies the library to a name derived from its content. An existing file is replaced unless its content matches:
/// it may have been truncated or damaged.
fn keep(built: &Path, bytes: &[u8]) -> Result<PathBuf, TargetError> {
    let name = format!("specgen-{}{}", &sha256(bytes)[..16], std::env::consts::DLL_SUFFIX);
    let kept = built.with_file_name(name);
    cache::put(&kept, bytes)?;
    Ok(kept)
}

/// Writes a file atomically.
///
/// # Errors
/// [`TargetError::Io`]; no partial file is left behind.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), TargetError> {
    cache::replace(path, bytes, false).map_err(|error| TargetError::io("writing", path, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_kept_library_is_verified_by_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let built = folder.path().join("libcontroller_host.so");
        let content = b"a library".to_vec();
        let kept = keep(&built, &content).unwrap();
        for damaged in [&b"a libr"[..], b"b library", b""] {
            fs::write(&kept, damaged).unwrap();
            let mapped = fs::File::open(&kept).unwrap();
            assert_eq!(keep(&built, &content).unwrap(), kept);
            assert_eq!(fs::read(&kept).unwrap(), content);
            // The file must be replaced, not rewritten: a process that has mapped the old one must not see it shrink.
            assert_eq!(mapped.metadata().unwrap().len(), damaged.len() as u64);
        }
    }
}
