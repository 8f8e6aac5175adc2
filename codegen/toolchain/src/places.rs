//! Where tools may be: the list of folders used by every search.

use super::user_cache;
use std::fs;
use std::path::{Path, PathBuf};

/// Environment variable with the folders to search instead of `PATH` and the usual ones, in the format of `PATH`.
pub const VARIABLE: &str = "SPECGEN_TOOLS";

/// Name of the folder of unpacked packages in the user's cache.
const FOLDER: &str = "tools";
/// Usual program folders, searched even if they are not on `PATH`.
const USUAL: [&str; 3] = ["/usr/local/bin", "/usr/bin", "/opt/homebrew/bin"];

/// Folders to search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Places {
    /// Program folders, in search order.
    pub programs: Vec<PathBuf>,
    /// Where packages are unpacked for this user; `None` without a cache folder.
    pub unpacked: Option<PathBuf>,
}

impl Places {
    /// The places of this machine and user.
    pub fn here() -> Self {
        let folders = |name| std::env::var_os(name).map(|list| std::env::split_paths(&list).collect::<Vec<PathBuf>>());
        let programs = folders(VARIABLE).unwrap_or_else(|| {
            let path = folders("PATH").unwrap_or_default();
            path.into_iter().chain(USUAL.map(PathBuf::from)).collect()
        });
        Self::of(programs, user_cache::folder().map(|cache| cache.join(FOLDER)))
    }

    /// Removes duplicates and makes paths absolute, so that they hold in any working folder.
    fn of(programs: Vec<PathBuf>, unpacked: Option<PathBuf>) -> Self {
        let mut seen = std::collections::BTreeSet::new();
        // `absolute` fails for an empty path.
        let mut programs: Vec<PathBuf> = programs.iter().filter_map(|path| std::path::absolute(path).ok()).collect();
        programs.retain(|folder| seen.insert(folder.clone()));
        Self { programs, unpacked: unpacked.and_then(|path| std::path::absolute(path).ok()) }
    }

    /// The first program of that name.
    pub fn program(&self, name: &str) -> Option<PathBuf> {
        self.all(name).next()
    }

    /// All programs of that name.
    pub fn all(&self, name: &str) -> impl Iterator<Item = PathBuf> {
        self.programs.iter().map(move |folder| folder.join(name)).filter(|file| file.is_file())
    }

    /// The packages unpacked under this name.
    pub fn unpacked(&self, name: &str) -> Option<PackageFolder> {
        PackageFolder::at(&self.unpacked.as_deref()?.join(name))
    }

    /// The folder for unpacked packages.
    pub fn cache(&self) -> Option<&Path> {
        self.unpacked.as_deref()
    }
}

/// A folder of unpacked packages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackageFolder {
    root: PathBuf,
}

impl PackageFolder {
    /// The folder, if it exists.
    pub fn at(root: &Path) -> Option<Self> {
        root.is_dir().then(|| Self { root: root.to_owned() })
    }

    /// A program in it.
    pub fn program(&self, name: &str) -> Option<PathBuf> {
        Some(self.programs().join(name)).filter(|file| file.is_file())
    }

    /// Folder of its programs.
    pub fn programs(&self) -> PathBuf {
        self.root.join("usr/bin")
    }

    /// Folders of its libraries, which Debian names after the architecture.
    pub fn libraries(&self) -> Vec<PathBuf> {
        let mut found = Vec::new();
        for base in ["usr/lib", "lib"] {
            let Ok(entries) = fs::read_dir(self.root.join(base)) else { continue };
            let named = entries.flatten().filter(|entry| entry.file_name().to_string_lossy().contains("-linux-gnu"));
            found.extend(named.map(|entry| entry.path()).filter(|path| path.is_dir()));
        }
        found.sort();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_folder_is_searched_once_and_in_order() {
        let root = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| root.path().join(name));
        for folder in [&a, &b] {
            fs::create_dir(folder).unwrap();
            fs::write(folder.join("tool"), "").unwrap();
        }
        let places = Places::of(vec![b.clone(), a.clone(), PathBuf::new(), b.clone()], None);
        assert_eq!(places.programs, [b.clone(), a.clone()]);
        assert_eq!(places.program("tool"), Some(b.join("tool")));
        assert_eq!(places.all("tool").count(), 2);
        assert_eq!(places.program("other"), None);
        assert!(places.unpacked("tool").is_none());
        assert!(Places::of(Vec::new(), Some("cache".into())).cache().unwrap().is_absolute());
    }
}
