//! The Unicorn engine, on which the repository's emulated boards run: a library that is opened at run time (`tests/board`).

use super::error::TargetError;
use super::places::Places;
use std::path::{Path, PathBuf};

/// Debian's package.
pub(super) const PACKAGE: &str = "libunicorn2";
const FILE: &str = "libunicorn.so.2";
/// The variable of the environment that names the library instead.
const VARIABLE: &str = "SPECGEN_UNICORN";
/// Where the system has libraries, with one folder for each architecture in it.
const USUAL: &str = "/usr/lib";

/// The library, where it is named, among the system's, or among what was unpacked.
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
        looked: format!("{FILE} among the system's libraries and in specgen's cache, and {VARIABLE}"),
        command: install_command(),
    })
}

/// What installs it, for whoever may.
#[must_use]
pub fn install_command() -> String {
    format!("apt-get install {PACKAGE} on Debian; elsewhere set {VARIABLE} to the library of unicorn 2")
}
