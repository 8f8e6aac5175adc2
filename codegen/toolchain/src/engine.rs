//! The Unicorn engine, which runs the repository's emulated boards (`tests/board`): a library loaded at run time.

use super::error::TargetError;
use super::places::Places;
use std::path::{Path, PathBuf};

/// Debian's package.
pub(super) const PACKAGE: &str = "libunicorn2";
const FILE: &str = "libunicorn.so.2";
/// Environment variable with the path of the library.
const VARIABLE: &str = "SPECGEN_UNICORN";
/// The system's library folders are below this one, one per architecture.
const USUAL: &str = "/usr/lib";

/// The library from `SPECGEN_UNICORN`, the system's folders, or the unpacked packages.
///
/// # Errors
/// [`TargetError::MissingTool`] with the command that installs it.
pub fn find_in(places: &Places) -> Result<PathBuf, TargetError> {
    let named = std::env::var_os(VARIABLE).map(PathBuf::from);
    let system = std::fs::read_dir(USUAL).into_iter().flatten().flatten().map(|entry| entry.path());
    let unpacked = places.unpacked(PACKAGE).map(|at| at.libraries()).unwrap_or_default();
    let folders = system.chain(unpacked).chain([Path::new(USUAL).to_owned(), "/usr/local/lib".into()]);
    let found = named.into_iter().chain(folders.map(|folder| folder.join(FILE))).find(|file| file.is_file());
    found.ok_or_else(|| TargetError::MissingTool {
        tool: "the Unicorn engine".into(),
        looked: format!("{FILE} in the system's library folders and specgen's cache, and in {VARIABLE}"),
        command: install_command(),
    })
}

/// The command that installs it.
pub fn install_command() -> String {
    format!("apt-get install {PACKAGE} on Debian; elsewhere set {VARIABLE} to the library of unicorn 2")
}
