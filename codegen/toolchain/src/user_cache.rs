//! The folders of the user's cache that specgen may fill: kept builds, and tools that were unpacked for this user alone.
//! Everything in them can be made again; removing them is always safe.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The variable of the environment that names another folder for kept builds; empty for none. Tools stay where they are: a
/// command that keeps no builds still needs them.
pub const VARIABLE: &str = "SPECGEN_CACHE";

/// `specgen` in the system's folder for caches: `XDG_CACHE_HOME`, `~/.cache`, on macOS `~/Library/Caches`. None without a home.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    below(&variable, std::env::home_dir().as_deref(), cfg!(target_os = "macos"))
}

/// Where builds are kept: `builds` in the folder that [`VARIABLE`] names, else in [`folder`]. None if the variable is empty.
#[must_use]
pub fn builds() -> Option<PathBuf> {
    match variable(VARIABLE) {
        Some(given) if given.is_empty() => None,
        Some(given) => Some(PathBuf::from(given).join("builds")),
        None => Some(folder()?.join("builds")),
    }
}

fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name)
}

fn below(variable: &dyn Fn(&str) -> Option<OsString>, home: Option<&Path>, mac: bool) -> Option<PathBuf> {
    // The XDG specification: a relative path is to be ignored.
    let xdg = variable("XDG_CACHE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let below_home = || home.map(|home| home.join(if mac { "Library/Caches" } else { ".cache" }));
    xdg.or_else(below_home).map(|folder| folder.join("specgen"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn xdg_comes_before_home() {
        let home = Some(Path::new("/home/a"));
        let of = |xdg: Option<&str>, home: Option<&Path>, mac: bool| below(&|_| xdg.map(OsString::from), home, mac);
        assert_eq!(of(None, home, false), Some("/home/a/.cache/specgen".into()));
        assert_eq!(of(None, home, true), Some("/home/a/Library/Caches/specgen".into()));
        assert_eq!(of(Some("/c"), home, false), Some("/c/specgen".into()));
        assert_eq!(of(Some("c"), home, false), Some("/home/a/.cache/specgen".into()));
        assert_eq!(of(None, None, false), None);
    }
}
