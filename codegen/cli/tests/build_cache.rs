//! The build cache: nothing is built twice, and cached files are verified.

#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::support::{Document, Folder, Run, length, skipped};
use serde_json::Value;

/// A folder with a `cargo` that counts its builds, and a separate cache.
struct BuildCounter(Folder);

impl BuildCounter {
    fn new() -> Self {
        let folder = Folder::new();
        let cargo = specgen::target::find_program("cargo").unwrap();
        fs::create_dir(folder.path("bin")).unwrap();
        let place = folder.path("");
        let (place, cargo) = (place.display(), cargo.display());
        let script = format!(
            "#!/bin/sh\nif [ \"$1\" != -vV ]; then\n  echo \"$1\" >> '{place}/runs'\n  [ ! -e '{place}/broken' ] || exit 1\nfi\nexec '{cargo}' \"$@\"\n"
        );
        folder.write("bin/cargo", script);
        fs::set_permissions(folder.path("bin/cargo"), fs::Permissions::from_mode(0o755)).unwrap();
        Self(folder)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let path = std::env::var("PATH").unwrap();
        let mut command = self.0.command();
        command.args(arguments).env("PATH", format!("{}:{path}", self.0.path("bin").display()));
        command.env("SPECGEN_CACHE", self.0.path("cache"));
        command
    }

    /// Runs a command that succeeds, and returns how often cargo was called to build.
    fn builds(&self, arguments: &[&str]) -> usize {
        self.builds_with(&mut self.command(arguments)).0
    }

    fn builds_with(&self, command: &mut Command) -> (usize, Run) {
        let _ = fs::remove_file(self.0.path("runs"));
        let run = Run::of(command);
        assert_eq!(run.code, 0, "{run:#?}");
        (self.runs(), run)
    }

    fn runs(&self) -> usize {
        fs::read_to_string(self.0.path("runs")).map_or(0, |text| text.lines().count())
    }

    /// The result of `specgen cache` as JSON.
    fn cache(&self, arguments: &[&str]) -> Value {
        Document::of(&Run::of(&mut self.command(arguments))).value["result"].clone()
    }

    fn entries(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(self.0.path("cache/builds")).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    }
}

const SIM: [&str; 7] = ["sim", "legs.toml", "--emitted", "--record", "run.rec", "--seconds", "0.1"];
const REPLAY: [&str; 5] = ["replay", "run.rec", "--spec", "legs.toml", "--emitted"];

fn edit(path: &Path, edit: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(path).unwrap();
    edit(&mut bytes);
    fs::write(path, bytes).unwrap();
}

fn flip(bytes: &mut [u8]) {
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
}

#[test]
fn an_unchanged_spec_is_built_once_and_everything_else_anew() {
    let counter = BuildCounter::new();
    let folder = &counter.0;
    assert_eq!(counter.builds(&SIM), 1);
    let recorded = fs::read(folder.path("run.rec")).unwrap();

    // A failing cargo is not called.
    folder.write("broken", "");
    for command in [&SIM[..], &REPLAY] {
        assert_eq!(counter.builds(command), 0, "{command:?}");
    }
    assert_eq!(fs::read(folder.path("run.rec")).unwrap(), recorded);
    // Profiles and flags in the environment reach no build, so they cause no other build.
    let mut set = counter.command(&SIM);
    set.env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "0").env("RUSTFLAGS", "-Copt-level=0").env("CARGO_INCREMENTAL", "1");
    assert_eq!(counter.builds_with(&mut set).0, 0);
    // Without the cache it is built again.
    let uncached = [&SIM[..], &["--no-cache"]].concat();
    assert_eq!(Run::of(&mut counter.command(&uncached)).code, 3);
    assert_eq!(Run::of(counter.command(&SIM).env("SPECGEN_CACHE", "")).code, 3);
    fs::remove_file(folder.path("broken")).unwrap();

    if length(true, false) {
        // Commands that need a build are recognised by that.
        folder.write("broken", "");
        let asks = |arguments: &[&str]| {
            let _ = fs::remove_file(folder.path("runs"));
            let run = Run::of(&mut counter.command(arguments));
            assert_eq!((run.code, counter.runs()), (3, 1), "{arguments:?}: {run:#?}");
            run.stderr
        };
        let [entry] = counter.entries().try_into().unwrap();
        edit(&entry, |bytes| flip(bytes));
        assert_eq!(asks(&REPLAY).matches("warning: a cached build was damaged").count(), 1);
        assert!(counter.entries().is_empty());
        folder.write("legs.toml", folder.read("legs.toml").replace("name = \"", "name = \"other-"));
        asks(&SIM);
        return skipped("only in the full run: what was damaged and another source are built");
    }
    // A damaged entry is detected, reported, removed and rebuilt, with the same result.
    // (Every bit and every cut of an entry: the unit tests of the cache.)
    let [entry] = counter.entries().try_into().unwrap();
    edit(&entry, |bytes| flip(bytes));
    let (builds, run) = counter.builds_with(&mut counter.command(&REPLAY));
    assert_eq!(builds, 1);
    assert_eq!(run.stderr.matches("warning: a cached build was damaged").count(), 1, "{}", run.stderr);
    assert_eq!(counter.builds(&REPLAY), 0);

    // Another source.
    let text = folder.read("legs.toml");
    folder.write("legs.toml", text.replace("name = \"", "name = \"other-"));
    assert_eq!((counter.builds(&SIM), counter.builds(&SIM)), (1, 0));
    assert_eq!(counter.entries().len(), 2);
    // Listing and clearing.
    let shown = counter.cache(&["cache", "--json"]);
    assert_eq!(shown["builds"], 2, "{shown}");
    assert!(shown["bytes"].as_u64().unwrap() > 10_000 && shown["removed"] == 0, "{shown}");
    let cleared = counter.cache(&["cache", "--clear", "--json"]);
    assert_eq!((&cleared["removed"], &cleared["builds"], &cleared["bytes"]), (&2.into(), &0.into(), &0.into()));
    assert!(counter.entries().is_empty());
    let empty = Run::of(counter.command(&["cache"]).env("SPECGEN_CACHE", ""));
    assert!(empty.code == 0 && empty.stdout.starts_with("no builds are kept"), "{empty:?}");
}

#[test]
#[ignore = "long: a controller built beside itself"]
fn two_at_once_keep_one_build() {
    let counter = BuildCounter::new();
    let commands =
        ["a.rec", "run.rec"].map(|file| ["sim", "legs.toml", "--emitted", "--record", file, "--seconds", "0.1"]);
    let started = commands
        .map(|arguments| counter.command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
    for child in started {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
    }
    assert_eq!(counter.entries().len(), 1);
    assert_eq!(counter.builds(&REPLAY), 0);
    assert_eq!(fs::read(counter.0.path("a.rec")).unwrap(), fs::read(counter.0.path("run.rec")).unwrap());
}

#[test]
#[ignore = "long: two controllers built without a cache"]
fn a_cache_that_cannot_be_written_costs_one_line() {
    let counter = BuildCounter::new();
    let mut nowhere = counter.command(&SIM);
    let (builds, run) = counter.builds_with(nowhere.env("SPECGEN_CACHE", "/dev/null/cache"));
    assert_eq!(builds, 1);
    assert_eq!(run.stderr.matches("warning: the build could not be cached").count(), 1, "{}", run.stderr);
    let mut nowhere = counter.command(&SIM);
    let (builds, run) = counter.builds_with(nowhere.arg("--json").env("SPECGEN_CACHE", "/dev/null/cache"));
    assert_eq!((builds, run.stderr.as_str()), (1, ""));
}

#[test]
#[ignore = "long: five builds without a cache"]
fn what_lies_in_the_output_folder_is_not_believed() {
    let counter = BuildCounter::new();
    let build = ["build", "minimal.toml", "--target", "host", "-o", "out", "--json"];
    let artifact = |command: &mut Command| {
        let (builds, run) = counter.builds_with(command);
        let document = Document::of(&run);
        (builds, counter.0.path(document.value["result"]["artifact"].as_str().unwrap()))
    };
    let (builds, library) = artifact(&mut counter.command(&build));
    assert_eq!(builds, 1);
    let good = fs::read(&library).unwrap();
    // Cargo has written a lock file, which proves nothing.
    assert_eq!((counter.0.path("out/Cargo.lock").is_file(), counter.builds(&build)), (true, 0));

    // The library under the name of its digest.
    let damages: [fn(&mut Vec<u8>); 2] = [|bytes| flip(bytes), |bytes| bytes.truncate(100)];
    for damage in damages {
        edit(&library, damage);
        assert_eq!(artifact(&mut counter.command(&build)), (0, library.clone()));
        assert!(fs::read(&library).unwrap() == good);
    }
    // Cargo's own output, without the cache: sources are rewritten, so cargo compiles them.
    let made = library.with_file_name(format!(
        "{}controller_host{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    ));
    let uncached = [&build[..], &["--no-cache"]].concat();
    assert_eq!(artifact(&mut counter.command(&uncached)), (1, library.clone()));
    edit(&made, |bytes| flip(bytes));
    assert_eq!(artifact(&mut counter.command(&uncached)), (1, library.clone()));
    assert!(fs::read(&library).unwrap() == good && fs::read(&made).unwrap() == good);

    // Cargo's configuration.
    fs::create_dir(counter.0.path(".cargo")).unwrap();
    counter.0.write(".cargo/config.toml", "[profile.release]\ndebug = 0\n");
    assert_eq!((counter.builds(&build), counter.builds(&build)), (1, 0));
}
