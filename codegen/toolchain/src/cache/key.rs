//! The cache key: everything that determines the bytes of a build - sources, command with all flags, and tools.

use crate::process::{clean_command, decides_on_link, find_in_path, printed};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::UNIX_EPOCH;
use toml::Value;

/// Increase when the meaning of a key changes.
const VERSION: &str = "3";
/// Keys of cargo's configuration with effects that the cache key cannot see: other sources, files, or another compiler.
const BEYOND: [&[&str]; 4] = [&["paths"], &["patch"], &["include"], &["build", "rustc"]];

/// State of the inputs before a build.
pub(super) struct Recipe {
    package: PathBuf,
    /// Digest of everything but the sources.
    context: Digester,
    sources: [u8; 32],
}

impl Recipe {
    /// `None` if something that affects the output cannot be read.
    pub fn of(command: &Command, package: &Path, rustc_args: &[&str]) -> Option<Self> {
        let mut context = Digester::default();
        context.add(VERSION);
        context.add(std::env::consts::ARCH);
        context.add(command.get_program().as_encoded_bytes());
        command.get_args().for_each(|argument| context.add(argument.as_encoded_bytes()));
        let set: BTreeMap<_, _> = command.get_envs().filter_map(|(name, value)| Some((name, value?))).collect();
        for (name, value) in &set {
            context.add(name.as_encoded_bytes());
            context.add(value.as_encoded_bytes());
        }
        for (name, value) in std::env::vars_os().filter(|(name, _)| decides_on_link(name)) {
            context.add(name.as_encoded_bytes());
            context.add(value.as_encoded_bytes());
        }
        rustc_args.iter().for_each(|argument| context.add(argument));
        // Cargo resolves links as well, since it runs in this folder.
        let package = fs::canonicalize(package).ok()?;
        configuration(&package, &mut context)?;
        tools(command, &package, &mut context)?;
        let sources = sources(&package)?;
        Some(Self { package, context, sources })
    }

    /// The key of the build.
    pub fn key(&self) -> String {
        let mut key = self.context.clone();
        key.add(self.sources);
        key.digest().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// True if the sources have not changed since.
    pub fn is_current(&self) -> bool {
        sources(&self.package) == Some(self.sources)
    }
}

#[derive(Clone, Default)]
struct Digester(Sha256);

impl Digester {
    fn add(&mut self, bytes: impl AsRef<[u8]>) {
        // The length separates neighbouring fields.
        self.0.update((bytes.as_ref().len() as u64).to_le_bytes());
        self.0.update(bytes.as_ref());
    }

    /// Adds path, size and time of a file, or of every file below a folder, if it exists: for files that only an installation changes.
    fn stamp(&mut self, path: &Path) -> Option<()> {
        let Ok(path) = fs::canonicalize(path) else { return Some(()) };
        let metadata = fs::metadata(&path).ok()?;
        if metadata.is_dir() {
            let mut paths: Vec<PathBuf> =
                fs::read_dir(&path).ok()?.map(|entry| Some(entry.ok()?.path())).collect::<Option<_>>()?;
            paths.sort();
            return paths.iter().try_for_each(|path| self.stamp(path));
        }
        let time = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        self.add(path.as_os_str().as_encoded_bytes());
        self.add(metadata.len().to_le_bytes());
        self.add(time.as_nanos().to_le_bytes());
        Some(())
    }

    fn digest(self) -> [u8; 32] {
        self.0.finalize().into()
    }
}

/// Adds cargo, compiler, the compiler's libraries, and linkers.
fn tools(command: &Command, package: &Path, context: &mut Digester) -> Option<()> {
    // Cargo may be a proxy that picks the compiler by the working folder, so ask in the package.
    let ask = |program: &Path, arguments: &[&str]| printed(clean_command(program).current_dir(package).args(arguments));
    let variable = |name: &str| command.get_envs().find(|(set, _)| *set == name).and_then(|(_, value)| value);
    let compiler = variable("RUSTC").map_or_else(|| PathBuf::from("rustc"), PathBuf::from);
    context.add(ask(Path::new(command.get_program()), &["-vV"])?);
    context.add(ask(&compiler, &["-vV"])?);
    let sysroot = ask(&compiler, &["--print", "sysroot"])?;
    let sysroot = Path::new(sysroot.trim_end());
    // A locally built compiler may change without a new version.
    let libraries = fs::read_dir(sysroot.join("lib")).into_iter().flatten().flatten();
    let driver = libraries.filter(|entry| entry.file_name().to_string_lossy().starts_with("librustc_driver"));
    let mut files: Vec<PathBuf> = driver.map(|entry| entry.path()).collect();
    files.sort();
    files.extend(["bin/rustc", "lib/rustlib"].map(|path| sysroot.join(path)));
    files.iter().try_for_each(|path| context.stamp(path))?;
    let flags = variable("CARGO_ENCODED_RUSTFLAGS").map(|flags| flags.to_string_lossy().into_owned());
    let given = flags.iter().flat_map(|flags| flags.split('\u{1f}')).filter_map(|flag| flag.strip_prefix("-Clinker="));
    let on_path = ["cc", "ld"].into_iter().filter_map(find_in_path);
    given.map(PathBuf::from).chain(on_path).try_for_each(|linker| context.stamp(&linker))
}

/// Adds cargo's configuration files, from the package's folder upwards and in cargo's home.
fn configuration(package: &Path, context: &mut Digester) -> Option<()> {
    let home = std::env::var_os("CARGO_HOME").filter(|home| !home.is_empty()).map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let folders: Vec<PathBuf> = package.ancestors().map(|folder| folder.join(".cargo")).chain(home).collect();
    for folder in folders {
        for name in ["config.toml", "config"] {
            let path = folder.join(name);
            if !path.is_file() {
                continue;
            }
            let text = fs::read_to_string(&path).ok()?;
            let table: toml::Table = text.parse().ok()?;
            // Names of commands decide on no build.
            if table.keys().all(|key| key == "alias") {
                continue;
            }
            let table = Value::Table(table);
            if BEYOND.iter().any(|keys| keys.iter().try_fold(&table, |value, key| value.get(key)).is_some()) {
                return None;
            }
            // Relative paths in a configuration depend on its folder. The package's own configuration has none.
            if folder != package.join(".cargo") {
                context.add(path.as_os_str().as_encoded_bytes());
            }
            context.add(text);
        }
    }
    Some(())
}

/// Digest of all files that a build of the package can see: the package, its path dependencies recursively,
/// and manifest and lock file of the workspace. `None` if one cannot be read.
fn sources(package: &Path) -> Option<[u8; 32]> {
    let root = package.parent().unwrap_or(package);
    let mut files = BTreeMap::new();
    let mut open = vec![package.to_owned(), root.join("Cargo.toml")];
    // Cargo creates a missing lock file; one without registry sources carries no information. A package that is its own workspace
    // has its own lock file.
    let lock = root.join("Cargo.lock");
    let says = |text: String| text.lines().any(|line| line.starts_with("source = "));
    if !package.join("Cargo.lock").is_file() && fs::read_to_string(&lock).is_ok_and(says) {
        open.push(lock);
    }
    let mut seen = BTreeSet::new();
    while let Some(path) = open.pop() {
        if !seen.insert(path.clone()) {
            continue;
        }
        collect(&path, &mut files)?;
        let folder = if path.ends_with("Cargo.toml") { root } else { &path };
        if let Some(manifest) = files.get(&folder.join("Cargo.toml")) {
            open.extend(named(folder, &String::from_utf8_lossy(manifest)));
        }
    }
    let mut digest = Digester::default();
    for (path, content) in files {
        // Relative, so that a copy of the workspace in another folder has the same key.
        digest.add(path.strip_prefix(root).unwrap_or(&path).as_os_str().as_encoded_bytes());
        digest.add(content);
    }
    Some(digest.digest())
}

/// All existing paths that a manifest in `folder` names by a key `path`. Cargo reports missing ones.
fn named(folder: &Path, manifest: &str) -> Vec<PathBuf> {
    const KEY: &str = "path";
    let value = |(at, _)| {
        let behind = manifest[at + KEY.len()..].trim_start_matches(['"', '\'', ' ', '\t']);
        behind.strip_prefix('=')?.trim_start().get(1..)?.split(['"', '\'']).next()
    };
    let paths = manifest.match_indices(KEY).filter_map(value);
    paths.filter_map(|path| fs::canonicalize(folder.join(path)).ok()).collect()
}

/// Adds a file, or all files below a folder except cargo's output.
fn collect(path: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) -> Option<()> {
    if path.is_file() {
        files.insert(path.to_owned(), fs::read(path).ok()?);
    } else if path.is_dir() {
        for entry in fs::read_dir(path).ok()? {
            let entry = entry.ok()?;
            if entry.file_name() != "target" {
                collect(&entry.path(), files)?;
            }
        }
    }
    Some(())
}
