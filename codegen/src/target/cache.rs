//! Artifacts kept by what they are made of, so that nothing is compiled twice: the folder that [`FOLDER`] names.
//!
//! The key is a digest of the sources that a build can see, of its command with all flags, and of the compiler. Where sources
//! come from other folders of the workspace (`../runtime`), these count as well. What cargo's own configuration files say
//! does not: whoever sets the variable keeps them as they are. Programs that run at once may share the folder.

use super::error::TargetError;
use super::process::{clean_command, first_line};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The variable of the environment that switches the cache on.
pub const FOLDER: &str = "SPECGEN_BUILD_CACHE";
/// Changes with the meaning of a key.
const VERSION: &str = "1";

/// The place of one artifact, held while this lives: nobody else makes it meanwhile.
pub(super) struct Slot {
    /// Holds the artifact under its own name.
    folder: PathBuf,
    _lock: File,
}

impl Slot {
    /// The place for what `command` makes of `package` with `rustc_args`; none without the variable.
    ///
    /// # Errors
    /// [`TargetError::Io`] if the sources cannot be read or the folder cannot be written.
    pub fn of(command: &Command, package: &Path, rustc_args: &[&str]) -> Result<Option<Self>, TargetError> {
        match std::env::var_os(FOLDER) {
            Some(folder) if !folder.is_empty() => {
                Self::within(Path::new(&folder), command, package, rustc_args).map(Some)
            }
            _ => Ok(None),
        }
    }

    fn within(cache: &Path, command: &Command, package: &Path, rustc_args: &[&str]) -> Result<Self, TargetError> {
        let folder = cache.join(key(command, package, rustc_args)?);
        fs::create_dir_all(cache).map_err(|e| TargetError::io("creating", cache, e))?;
        let lock_path = folder.with_extension("lock");
        let lock = File::create(&lock_path).map_err(|e| TargetError::io("creating", &lock_path, e))?;
        lock.lock().map_err(|e| TargetError::io("locking", &lock_path, e))?;
        Ok(Self { folder, _lock: lock })
    }

    /// What was made earlier, if it was, put into `target_dir` under its own name: path and bytes.
    ///
    /// # Errors
    /// [`TargetError::Io`] if it cannot be put there.
    pub fn fetch(&self, target_dir: &Path) -> Result<Option<(PathBuf, Vec<u8>)>, TargetError> {
        let Some(kept) = fs::read_dir(&self.folder).ok().and_then(|mut entries| entries.next()?.ok()) else {
            return Ok(None);
        };
        let kept = kept.path();
        let bytes = fs::read(&kept).map_err(|e| TargetError::io("reading", &kept, e))?;
        let path = target_dir.join(kept.file_name().unwrap_or_default());
        if path.exists() {
            fs::remove_file(&path).map_err(|e| TargetError::io("removing", &path, e))?;
        }
        // A link first: a program that was just written by this process may be refused as busy. Between disks, a copy.
        fs::hard_link(&kept, &path)
            .or_else(|_| fs::copy(&kept, &path).map(|_| ()))
            .map_err(|e| TargetError::io("writing", &path, e))?;
        Ok(Some((path, bytes)))
    }

    /// Keeps a copy, which stays executable.
    ///
    /// # Errors
    /// [`TargetError::Io`] if it cannot be written.
    pub fn keep(&self, built: &Path) -> Result<(), TargetError> {
        // Copied beside and renamed, so that a copy that was cut off is never taken for the whole.
        let partial = self.folder.with_extension("part");
        fs::create_dir_all(&partial).map_err(|e| TargetError::io("creating", &partial, e))?;
        let copy = partial.join(built.file_name().unwrap_or_default());
        fs::copy(built, &copy).map_err(|e| TargetError::io("writing", &copy, e))?;
        fs::rename(&partial, &self.folder).map_err(|e| TargetError::io("renaming", &partial, e))
    }
}

/// A name for all that decides about the bytes of the artifact.
fn key(command: &Command, package: &Path, rustc_args: &[&str]) -> Result<String, TargetError> {
    let environment: BTreeMap<_, _> = command
        .get_envs()
        .filter_map(|(name, value)| Some((name.as_encoded_bytes(), value?.as_encoded_bytes())))
        .collect();
    // Cargo runs where the package is, and may be a proxy that picks the compiler by that.
    let version =
        |program: &Path| first_line(clean_command(program).current_dir(package).arg("--version")).unwrap_or_default();
    let compiler = command.get_envs().find(|(name, _)| *name == "RUSTC").and_then(|(_, value)| value);
    let compiler = compiler.map_or_else(|| PathBuf::from("rustc"), PathBuf::from);

    let mut digest = Sha256::new();
    // Lengths keep neighbours apart.
    let mut add = |bytes: &[u8]| {
        digest.update((bytes.len() as u64).to_le_bytes());
        digest.update(bytes);
    };
    add(VERSION.as_bytes());
    add(std::env::consts::ARCH.as_bytes());
    add(command.get_program().as_encoded_bytes());
    add(version(Path::new(command.get_program())).as_bytes());
    add(version(&compiler).as_bytes());
    for argument in command.get_args() {
        add(argument.as_encoded_bytes());
    }
    for (name, value) in environment {
        add(name);
        add(value);
    }
    for argument in rustc_args {
        add(argument.as_bytes());
    }
    for (name, content) in sources(package)? {
        add(name.as_bytes());
        add(&content);
    }
    Ok(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Every file that a build of the package can see, by its path in the workspace: the package, the folders beside it that its
/// manifest names, theirs, and the manifest and lock file of the workspace.
fn sources(package: &Path) -> Result<BTreeMap<String, Vec<u8>>, TargetError> {
    let root = package.parent().unwrap_or(package);
    let mut files = BTreeMap::new();
    for name in ["Cargo.toml", "Cargo.lock"] {
        let path = root.join(name);
        if path.is_file() {
            files.insert(name.to_owned(), read(&path)?);
        }
    }
    let mut seen = BTreeSet::new();
    let mut open: Vec<String> =
        package.file_name().map(|name| name.to_string_lossy().into_owned()).into_iter().collect();
    while let Some(folder) = open.pop() {
        if !seen.insert(folder.clone()) {
            continue;
        }
        collect(&root.join(&folder), &folder, &mut files)?;
        if let Some(manifest) = files.get(&format!("{folder}/Cargo.toml")) {
            open.extend(neighbours(&String::from_utf8_lossy(manifest)));
        }
    }
    Ok(files)
}

/// The `NAME` of every `"../NAME"` in a manifest.
fn neighbours(manifest: &str) -> Vec<String> {
    let quoted = manifest.split("\"../").skip(1).filter_map(|rest| rest.split(['"', '/']).next());
    quoted.map(str::to_owned).collect()
}

fn collect(folder: &Path, name: &str, files: &mut BTreeMap<String, Vec<u8>>) -> Result<(), TargetError> {
    let entries = fs::read_dir(folder).map_err(|e| TargetError::io("reading", folder, e))?;
    for entry in entries {
        let path = entry.map_err(|e| TargetError::io("reading", folder, e))?.path();
        let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let name = format!("{name}/{own}");
        if !path.is_dir() {
            files.insert(name, read(&path)?);
        } else if own != "target" {
            // What cargo made is no source.
            collect(&path, &name, files)?;
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>, TargetError> {
    fs::read(path).map_err(|e| TargetError::io("reading", path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A workspace of a program and what it uses; `extra` goes into a folder that it does not use.
    fn workspace(root: &Path, used: &str, extra: &str) -> PathBuf {
        for (name, text) in [
            ("Cargo.toml", "[workspace]\n"),
            ("program/Cargo.toml", "[dependencies]\nused = { path = \"../used\" }\n"),
            ("program/src/main.rs", "fn main() {}\n"),
            ("program/target/left", "by cargo"),
            ("used/Cargo.toml", "[dependencies]\ndeep = { path = \"../deep\" }\n"),
            ("used/src/lib.rs", ""),
            ("deep/src/lib.rs", used),
            ("other/src/lib.rs", extra),
        ] {
            let path = root.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root.join("program")
    }

    #[test]
    fn equal_sources_in_two_folders_share_a_key_and_everything_that_is_seen_changes_it() {
        let key_of = |used: &str, extra: &str, flag: &str, variable: &str, rustc: &[&str]| {
            let dir = tempfile::tempdir().unwrap();
            let package = workspace(dir.path(), used, extra);
            let mut command = Command::new("cargo");
            command.arg(flag).env("FLAGS", variable);
            key(&command, &package, rustc).unwrap()
        };
        let one = key_of("a", "x", "build", "1", &[]);
        assert_eq!(one, key_of("a", "x", "build", "1", &[]));
        assert_eq!(one, key_of("a", "y", "build", "1", &[]), "a folder that is not used");
        let others = [
            key_of("b", "x", "build", "1", &[]),
            key_of("a", "x", "rustc", "1", &[]),
            key_of("a", "x", "build", "2", &[]),
            key_of("a", "x", "build", "1", &["-Clink-arg=-lc"]),
        ];
        for (place, other) in others.iter().enumerate() {
            assert_ne!(&one, other, "{place}");
        }
    }

    #[test]
    fn what_was_kept_is_found_again_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let package = workspace(&dir.path().join("w"), "a", "x");
        let (cache, target) = (dir.path().join("cache"), dir.path().join("target"));
        fs::create_dir(&target).unwrap();
        let built = dir.path().join("program");
        fs::write(&built, b"artifact").unwrap();
        let slot = |flag: &str| Slot::within(&cache, Command::new("cargo").arg(flag), &package, &[]).unwrap();
        assert_eq!(slot("build").fetch(&target).unwrap(), None);
        slot("build").keep(&built).unwrap();
        // Twice: the second finds the first one's file in its way.
        for _ in 0..2 {
            let found = slot("build").fetch(&target).unwrap();
            assert_eq!(found, Some((target.join("program"), b"artifact".to_vec())));
            assert_eq!(fs::read(target.join("program")).unwrap(), b"artifact");
        }
        assert_eq!(slot("rustc").fetch(&target).unwrap(), None);
    }
}
