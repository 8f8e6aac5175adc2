//! The folder of the user's cache that specgen may fill: kept builds, and tools that were unpacked for this user alone.
//! Everything in it can be made again; removing it is always safe.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The variable of the environment that names another folder; empty for none at all.
pub const VARIABLE: &str = "SPECGEN_CACHE";

/// [`VARIABLE`] if it is set, else `specgen` in the system's folder for caches: `XDG_CACHE_HOME`, `~/.cache`, on macOS
/// `~/Library/Caches`. None if the variable is set and empty, or if there is neither variable nor home.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    resolve(&|name| std::env::var_os(name), std::env::home_dir().as_deref(), cfg!(target_os = "macos"))
}

fn resolve(variable: &dyn Fn(&str) -> Option<OsString>, home: Option<&Path>, mac: bool) -> Option<PathBuf> {
    if let Some(given) = variable(VARIABLE) {
        return (!given.is_empty()).then(|| PathBuf::from(given));
    }
    // The XDG specification: a relative path is to be ignored.
    let xdg = variable("XDG_CACHE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let below_home = || home.map(|home| home.join(if mac { "Library/Caches" } else { ".cache" }));
    xdg.or_else(below_home).map(|folder| folder.join("specgen"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_comes_before_xdg_and_that_before_home() {
        let home = Some(Path::new("/home/a"));
        let of = |set: &'static [(&str, &str)], home: Option<&Path>, mac: bool| {
            let variable = |name: &str| set.iter().find(|(known, _)| *known == name).map(|(_, value)| value.into());
            resolve(&variable, home, mac)
        };
        assert_eq!(of(&[], home, false), Some("/home/a/.cache/specgen".into()));
        assert_eq!(of(&[], home, true), Some("/home/a/Library/Caches/specgen".into()));
        assert_eq!(of(&[("XDG_CACHE_HOME", "/c")], home, false), Some("/c/specgen".into()));
        assert_eq!(of(&[("XDG_CACHE_HOME", "c")], home, false), Some("/home/a/.cache/specgen".into()));
        assert_eq!(of(&[(VARIABLE, "/own"), ("XDG_CACHE_HOME", "/c")], home, false), Some("/own".into()));
        assert_eq!(of(&[(VARIABLE, "")], home, false), None);
        assert_eq!(of(&[], None, false), None);
    }
}
