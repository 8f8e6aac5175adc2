use super::*;
use std::time::Duration;

/// A workspace with a program and the package it uses. `extra` goes into an unused folder.
fn workspace(root: &Path, used: &str, extra: &str) -> PathBuf {
    for (name, text) in [
        ("Cargo.toml", "[workspace]\n"),
        ("program/Cargo.toml", "[dependencies]\nused = { path = \"../used\" }\n"),
        ("program/src/main.rs", "fn main() {}\n"),
        ("program/target/left", "by cargo"),
        ("used/Cargo.toml", "[dependencies.deep]\npath = '../deep path'\n"),
        ("used/src/lib.rs", ""),
        ("deep path/Cargo.toml", "[dependencies]\nlast = {\"path\"=\"../last\"}\n"),
        ("last/src/lib.rs", used),
        ("other/src/lib.rs", extra),
    ] {
        let path = root.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    root.join("program")
}

/// Fake cargo and compiler that answer the queries made before a build.
struct Tools {
    folder: tempfile::TempDir,
}

impl Tools {
    fn new() -> Self {
        let tools = Self { folder: tempfile::tempdir().unwrap() };
        let root = tools.folder.path().display();
        tools.set("cargo 1", "rustc 1");
        for name in ["cargo", "rustc"] {
            let script = format!(
                "#!/bin/sh\ncase \"$1\" in\n-vV) cat '{root}/{name}.version';;\n--print) echo '{root}';;\nesac\n"
            );
            let path = tools.folder.path().join(name);
            replace(&path, script.as_bytes(), true).unwrap();
            // While another thread forks, the file may still count as open for writing.
            while Command::new(&path).output().is_err() {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        tools
    }

    fn set(&self, cargo: &str, rustc: &str) {
        for (name, version) in [("cargo", cargo), ("rustc", rustc)] {
            fs::write(self.folder.path().join(format!("{name}.version")), version).unwrap();
        }
    }

    fn command(&self) -> Command {
        let mut command = Command::new(self.folder.path().join("cargo"));
        command.env("RUSTC", self.folder.path().join("rustc"));
        command
    }
}

fn key(command: &Command, package: &Path, rustc_args: &[&str]) -> String {
    Recipe::of(command, package, rustc_args).unwrap().key()
}

#[test]
fn equal_sources_in_two_folders_share_a_key_and_every_input_changes_it() {
    let tools = Tools::new();
    let key_of = |used: &str, extra: &str, flag: &str, variable: &str, rustc: &[&str]| {
        let dir = tempfile::tempdir().unwrap();
        let package = workspace(dir.path(), used, extra);
        key(tools.command().arg(flag).env("FLAGS", variable), &package, rustc)
    };
    let one = key_of("a", "x", "build", "1", &[]);
    assert_eq!(one, key_of("a", "x", "build", "1", &[]));
    assert_eq!(one, key_of("a", "y", "build", "1", &[]), "an unused folder");
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
fn a_new_cargo_compiler_library_or_linker_changes_the_key() {
    let (tools, dir) = (Tools::new(), tempfile::tempdir().unwrap());
    let package = workspace(dir.path(), "a", "x");
    let root = tools.folder.path();
    let mut seen = vec![key(&tools.command(), &package, &[])];
    let mut differs = |what: &str| {
        let linker = format!("-Clinker={}", root.join("ld").display());
        let key = key(tools.command().env("CARGO_ENCODED_RUSTFLAGS", linker).arg("-Zbuild-std=core"), &package, &[]);
        assert!(!seen.contains(&key), "{what}");
        seen.push(key);
    };
    fs::write(root.join("ld"), "1").unwrap();
    differs("flags");
    tools.set("cargo 2", "rustc 1");
    differs("cargo");
    tools.set("cargo 2", "rustc 2");
    differs("rustc");
    for file in [
        "ld",
        "bin/rustc",
        "lib/librustc_driver-1.so",
        "lib/rustlib/thumbv7em-none-eabihf/lib/libcore.rlib",
        "lib/rustlib/src/rust/library/core/src/lib.rs",
    ] {
        let path = root.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        for content in ["one", "longer"] {
            fs::write(&path, content).unwrap();
            differs(file);
        }
    }
    // Same size: only the time changes.
    File::options().append(true).open(root.join("ld")).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
    differs("time");
    // If the compiler does not answer, its output is unknown.
    fs::remove_file(root.join("rustc")).unwrap();
    assert!(Recipe::of(&tools.command(), &package, &[]).is_none());
}

#[test]
fn the_configuration_of_cargo_changes_the_key() {
    let (tools, dir) = (Tools::new(), tempfile::tempdir().unwrap());
    let package = workspace(&dir.path().join("w"), "a", "x");
    let with = |text: &str| {
        let folder = dir.path().join(".cargo");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("config.toml"), text).unwrap();
        Recipe::of(&tools.command(), &package, &[]).map(|recipe| recipe.key())
    };
    let none = with("");
    assert!(none.is_some());
    assert_eq!(none, with(""));
    let flags = with("[build]\nrustflags = [\"-Ctarget-cpu=native\"]\n");
    let profile = with("[profile.release]\nopt-level = 1\n");
    assert!(flags.is_some() && profile.is_some() && flags != none && profile != none && flags != profile);
    for beyond in ["paths = [\"x\"]\n", "[patch.crates-io]\na = { path = \"a\" }\n", "[build]\nrustc = \"mine\"\n", "["]
    {
        assert_eq!(with(beyond), None, "{beyond}");
    }
}

#[test]
fn a_lock_file_with_sources_counts_and_changed_sources_are_not_cached() {
    let (tools, dir) = (Tools::new(), tempfile::tempdir().unwrap());
    let package = workspace(dir.path(), "a", "x");
    let recipe = Recipe::of(&tools.command(), &package, &[]).unwrap();
    let lock = |text: &str| fs::write(dir.path().join("Cargo.lock"), text).unwrap();
    // As cargo creates it.
    lock("version = 4\n\n[[package]]\nname = \"program\"\n");
    assert!(recipe.is_current());
    lock("version = 4\n\n[[package]]\nname = \"libm\"\nsource = \"registry\"\n");
    assert!(!recipe.is_current());
    assert_ne!(key(&tools.command(), &package, &[]), recipe.key());
    lock("");
    workspace(dir.path(), "b", "x");
    assert!(!recipe.is_current());
    let target = dir.path().join("target");
    Slot { cache: cache(dir.path(), 1000), recipe }.keep(&target, &target.join("x"), b"artifact");
    assert!(!dir.path().join("builds").exists());
}

fn cache(root: &Path, limit: u64) -> Cache {
    Cache { folder: root.join("builds"), limit }
}

#[test]
fn a_stored_build_is_found_again_and_nothing_else() {
    let (tools, dir) = (Tools::new(), tempfile::tempdir().unwrap());
    let package = workspace(&dir.path().join("w"), "a", "x");
    let target = dir.path().join("target");
    let built = target.join("release/program");
    let slot = |flag: &str| Slot::within(cache(dir.path(), 1000), tools.command().arg(flag), &package, &[]).unwrap();
    let first = slot("build");
    assert_eq!(first.fetch(&target).unwrap(), None);
    first.keep(&target, &built, b"artifact");
    // Twice: the second round finds the file of the first, damaged.
    for _ in 0..2 {
        let found = slot("build").fetch(&target).unwrap();
        assert_eq!(found, Some((built.clone(), b"artifact".to_vec())));
        assert_eq!(fs::read(&built).unwrap(), b"artifact");
        assert_eq!(fs::metadata(&built).unwrap().permissions().mode() & 0o777, 0o755);
        fs::write(&built, b"artefact").unwrap();
    }
    assert_eq!(slot("rustc").fetch(&target).unwrap(), None);
    assert_eq!(cache(dir.path(), 0).extent().unwrap().builds, 1);
}

#[test]
fn every_flipped_bit_and_every_truncation_is_detected() {
    let dir = tempfile::tempdir().unwrap();
    let cache = cache(dir.path(), 1000);
    let (key, other) = ("a".repeat(64), "b".repeat(64));
    let path = cache.folder.join(&key);
    cache.keep(&key, Path::new("release/x"), b"content").unwrap();
    let whole = fs::read(&path).unwrap();
    let flipped = (0..whole.len() * 8).map(|bit| {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        bytes
    });
    let cut = (0..whole.len()).map(|length| whole[..length].to_vec());
    let longer = [[&whole[..], b"x"].concat()];
    for damaged in flipped.chain(cut).chain(longer) {
        fs::write(&path, &damaged).unwrap();
        assert_eq!(cache.fetch(&key), None, "{}", String::from_utf8_lossy(&damaged));
        assert!(!path.exists());
    }
    // Intact, but stored under another key.
    fs::write(cache.folder.join(&other), &whole).unwrap();
    assert_eq!(cache.fetch(&other), None);
    fs::write(&path, &whole).unwrap();
    assert_eq!(cache.fetch(&key).unwrap().bytes, b"content");
    for outside in ["../x", "/x"] {
        fs::write(&path, pack(&key, Path::new(outside), b"content")).unwrap();
        assert_eq!(cache.fetch(&key), None);
    }
}

#[test]
fn the_least_recently_used_build_is_removed_first() {
    let dir = tempfile::tempdir().unwrap();
    let cache = cache(dir.path(), 450);
    let place = Path::new("x");
    let age = |key: &str, seconds: u64| {
        let file = File::open(cache.folder.join(key)).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
    };
    // Each entry adds 67 bytes to its content.
    for (key, seconds) in [("a", 30), ("b", 20), ("c", 10)] {
        cache.keep(key, place, &[0; 80]).unwrap();
        age(key, seconds);
    }
    // Used just now, so it is the newest.
    assert!(cache.fetch("a").is_some());
    cache.keep("d", place, &[0; 80]).unwrap();
    let there = |key: &str| cache.folder.join(key).is_file();
    assert_eq!(["a", "b", "c", "d"].map(there), [true, false, true, true]);
    assert!(cache.extent().unwrap().bytes <= 450);
    // Larger than the limit: not stored, and nothing is removed for it.
    cache.keep("e", place, &[0; 500]).unwrap();
    assert_eq!(cache.extent().unwrap(), Extent { builds: 3, bytes: 441 });
    // A temporary file of a killed process is not a build, and is removed like one.
    fs::write(cache.folder.join("f.1-0.part"), [0; 100]).unwrap();
    age("f.1-0.part", 100);
    assert_eq!(cache.extent().unwrap(), Extent { builds: 3, bytes: 541 });
    cache.keep("d", place, &[1; 80]).unwrap();
    assert_eq!(cache.clear().unwrap(), Extent { builds: 3, bytes: 441 });
    assert_eq!(cache.extent().unwrap(), Extent { builds: 0, bytes: 0 });
}

#[test]
fn an_unwritable_folder_is_no_failure() {
    let (tools, dir) = (Tools::new(), tempfile::tempdir().unwrap());
    let package = workspace(&dir.path().join("w"), "a", "x");
    fs::write(dir.path().join("builds"), "a file").unwrap();
    let slot = Slot::within(cache(dir.path(), 1000), &tools.command(), &package, &[]).unwrap();
    assert_eq!(slot.fetch(&dir.path().join("target")).unwrap(), None);
    slot.keep(dir.path(), &dir.path().join("program"), b"artifact");
    let warning = trouble().unwrap();
    assert!(!warning.contains('\n'), "{warning}");
}
