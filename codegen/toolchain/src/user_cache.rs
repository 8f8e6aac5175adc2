//! Folders in the user's cache: cached builds, and tools unpacked for this user.
//! They can be removed at any time; specgen recreates what it needs.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Environment variable that moves the build cache to another folder; empty disables it. It does not move the tools,
/// which a command needs even without a build cache.
pub const VARIABLE: &str = "SPECGEN_CACHE";

/// `specgen` in the system's cache folder: `XDG_CACHE_HOME`, `~/.cache`, on macOS `~/Library/Caches`. `None` without a home folder.
pub fn folder() -> Option<PathBuf> {
    below(&variable, std::env::home_dir().as_deref(), cfg!(target_os = "macos"))
}

/// The build cache: `builds` in the folder named by [`VARIABLE`], else in [`folder`]. `None` if the variable is empty.
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
    // The XDG specification says to ignore relative paths.
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
