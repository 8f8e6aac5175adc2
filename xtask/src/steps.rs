//! The steps of each command, in order.

use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;

use crate::binaries::{self, Binary, Mode, TestResults};
use crate::mutants::Sample;
use crate::run::{Outcome, Report, SKIPPED, cargo, expect_success};
use crate::setup::{self, TRIPLE};
use crate::{fuzz, mutants, packages, results, wheel};

/// A workspace for another machine.
const FIRMWARE: &str = "firmware/qemu/Cargo.toml";
/// A workspace for another machine, which estimates the tick time of boards.
const TICK: &str = "firmware/tick/Cargo.toml";
/// Built from an emitted workspace.
const HOST_LIBRARY: &str = "firmware/host/Cargo.toml";
/// The emulated board.
const EMULATED: &str = "tests/board/Cargo.toml";
/// Common code of boards, built with each of them.
const BOARDS_COMMON: &str = "firmware/stm32/Cargo.toml";
/// A separate workspace because of its dependencies.
const REAL_TIME: &str = "firmware/rt-pc/Cargo.toml";
/// Separate workspaces with their own lock files, except boards.
const STANDING_ALONE: [&str; 8] = [FIRMWARE, TICK, REAL_TIME, wheel::MANIFEST, SCHEMA, fuzz::MANIFEST, EMULATED, LOOM];
/// All lock files, except those of boards.
const LOCKED: [&str; 10] =
    ["Cargo.toml", FIRMWARE, TICK, REAL_TIME, wheel::MANIFEST, SCHEMA, fuzz::MANIFEST, EMULATED, LOOM, LINK_PROOF];
/// The example of a user's own board, with a generated workspace, as the test of the boards leaves it.
const OWN_BOARD: &str = "target/tests/boards/own-board/own-board/Cargo.toml";
/// A separate workspace, built by a test.
const LINK_PROOF: &str = "firmware/link/tests/proof/Cargo.toml";
/// Tests the published schema with a third-party validator. A separate workspace because of its dependencies.
const SCHEMA: &str = "tests/schema/Cargo.toml";
/// Tests the memory ordering between two processes with a model checker. A separate workspace because of its dependencies.
const LOOM: &str = "firmware/rt/tests/loom/Cargo.toml";
/// Packages outside of the workspace, except boards, which are formatted one by one.
const FORMATTED_ALONE: [&str; 10] =
    [FIRMWARE, TICK, HOST_LIBRARY, REAL_TIME, wheel::MANIFEST, BOARDS_COMMON, SCHEMA, fuzz::MANIFEST, EMULATED, LOOM];
/// Hand-written members of the workspace.
const HAND_WRITTEN: [&str; 25] = [
    "specgen",
    "specgen-cycles",
    "specgen-numerics",
    "specgen-language",
    "specgen-identify",
    "specgen-toolchain",
    "specgen-ir",
    "specgen-compiler",
    "specgen-run-time",
    "specgen-studies",
    "specgen-operate",
    "specgen-report",
    "specgen-law",
    "specgen-runtime",
    "specgen-hal",
    "specgen-link",
    "specgen-board",
    "specgen-board-passes",
    "specgen-rt",
    "host-sim",
    "plant-unit",
    "oracle",
    "specgen-tests",
    "specgen-benches",
    "xtask",
];

/// Members of the workspace that are emitted and formatted by specgen.
#[cfg(test)]
const EMITTED: [&str; 2] = ["controller", "controller-with-passes"];

/// Call of the program for commands and steps that use the product: see `tests/src/bin/maintain`.
const MAINTAIN: [&str; 7] =
    ["run", "--release", "--quiet", "--package=specgen-tests", "--bin=maintain", "--locked", "--"];

/// Runs a command of `maintain`.
pub fn maintain(root: &Path, words: &[&str]) -> ExitCode {
    match cargo(root, &[&MAINTAIN[..], words].concat()).status() {
        Ok(status) => ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)),
        Err(error) => {
            eprintln!("cargo cannot be run: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a step of `maintain`, which prints why it was skipped or failed.
pub fn maintained(root: &Path, words: &[&str]) -> Outcome {
    match cargo(root, &[&MAINTAIN[..], &["step"], words].concat()).status() {
        Ok(status) if status.success() => Outcome::Passed,
        Ok(status) if status.code() == Some(SKIPPED.into()) => Outcome::Skipped("see above".to_owned()),
        Ok(_) => Outcome::Failed("see above".to_owned()),
        Err(error) => Outcome::Failed(format!("cargo cannot be run: {error}")),
    }
}

/// Adds the manifests of boards to a list: the packages in `firmware` whose manifest has the table of a board. Each is a separate
/// workspace, built from an emitted one.
fn with_boards(root: &Path, manifests: &[&str]) -> Vec<String> {
    let folders = std::fs::read_dir(root.join("firmware")).into_iter().flatten().flatten();
    let is_board = |path: &String| {
        std::fs::read_to_string(root.join(path)).is_ok_and(|text| text.contains("\n[package.metadata.board]\n"))
    };
    let mut boards: Vec<String> = folders
        .map(|folder| format!("firmware/{}/Cargo.toml", folder.file_name().display()))
        .filter(is_board)
        .collect();
    boards.sort();
    manifests.iter().map(|manifest| (*manifest).to_owned()).chain(boards).collect()
}

/// `cargo xtask test`
pub fn test(root: &Path) -> ExitCode {
    let before = results::changes(root);
    let locked = with_boards(root, &LOCKED);
    let mut report = Report::new(8 + locked.len());
    report.step("the last full run", || results::judge(root));
    report.step("formatting", || formatting(root));
    let binaries = compiled(root, false, &mut report);
    let mode = Mode { tools_missing: !set_up(root, &mut report), ..Mode::default() };
    report.step("tests", || binaries::test(root, &binaries, mode, &mut TestResults::default()));
    // They need a second pass of the compiler.
    report.step("lints", || Outcome::Skipped("only in the full run: cargo xtask test --full".to_owned()));
    report.step("generated files are fresh", || maintained(root, &["check"]));
    for manifest in &locked {
        report.step(&format!("lock file and licences of {manifest}"), || packages::check(root, manifest));
    }
    report.step("the clone is unchanged", || results::unchanged(before.as_deref(), results::changes(root).as_deref()));
    report.finish()
}

/// `cargo xtask test --full`
pub fn full(root: &Path) -> ExitCode {
    let start = Instant::now();
    let mut report = Report::new(8);
    report.step("known defects of packages", || packages::advisories(root, &with_boards(root, &LOCKED)));
    let binaries = compiled(root, true, &mut report);
    let mode = Mode { full: true, tools_missing: !set_up(root, &mut report) };
    let mut ran = TestResults::default();
    report.step("tests at full length", || binaries::test(root, &binaries, mode, &mut ran));
    // Emulated boards take one processor, so what compiles and needs no tools runs beside them. At the lowest priority, because their
    // hosts time out if they get half a processor.
    std::thread::scope(|scope| {
        let beside = scope.spawn(|| {
            let own = std::env::current_exe()?;
            Command::new("nice").args(["-n", "19"]).arg(own).args(["test", "--checks"]).current_dir(root).output()
        });
        report.step("images on the emulated board, and faults", || maintained(root, &["boards"]));
        report.step("lock file and licences of examples/own-board/Cargo.toml", || {
            if root.join(OWN_BOARD).is_file() {
                packages::check(root, OWN_BOARD)
            } else {
                setup::missing(format!("{OWN_BOARD} is missing; the test of the boards creates it"))
            }
        });
        report.step("checks, beside the boards", || match beside.join() {
            Ok(Ok(output)) => {
                println!("{}", String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).trim());
                if output.status.success() {
                    Outcome::Passed
                } else {
                    Outcome::Failed("see above; run: cargo xtask test --checks".to_owned())
                }
            }
            Ok(Err(error)) => Outcome::Failed(format!("nice cannot be run: {error}")),
            Err(_) => Outcome::Failed("the thread that runs them ended early".to_owned()),
        });
    });
    let (good, tests) = (!report.has_failed(), results::of_tests(&ran, start.elapsed()));
    report.step("result of the full run", || results::write(root, results::FULL, good, &tests));
    report.finish()
}

/// `cargo xtask test --checks`: the part of the full run that runs beside the emulated boards.
pub fn checks(root: &Path) -> ExitCode {
    let mut report = Report::new(6);
    report.step("tests with all checks", || checked(root));
    report.step("lints", || lints(root));
    report.step("examples in the documentation", || binaries::examples(root));
    report.step("documentation", || {
        let mut doc = cargo(root, &["doc", "--release", "--workspace", "--no-deps", "--quiet"]);
        doc.env("RUSTDOCFLAGS", "-D warnings");
        expect_success(doc, "see the warnings above")
    });
    report.step("published schema", || separate(root, SCHEMA));
    report.step("shared-memory ordering", || separate(root, LOOM));
    report.finish()
}

/// `cargo xtask mutants`
pub fn mutants(root: &Path, sample: &Sample) -> ExitCode {
    let mut report = Report::new(2);
    let mut counts = String::new();
    report.step("mutants", || mutants::run(root, sample, &mut counts));
    let good = !report.has_failed();
    report.step("result of the mutants", || results::write(root, "mutants", good, &counts));
    report.finish()
}

/// Tests with debug assertions and overflow checks, for code that runs in every tick or reads external input.
fn checked(root: &Path) -> Outcome {
    let kernels = ["law", "runtime", "link", "hal", "board", "rt"].map(|name| format!("--package=specgen-{name}"));
    let kernels: Vec<&str> = kernels.iter().map(String::as_str).chain(["--package=host-sim"]).collect();
    // The same packages for both, so that cargo compiles what they share once: other packages would mean other features.
    let compiler =
        ["language", "identify", "compiler", "studies", "tests"].map(|name| format!("--package=specgen-{name}"));
    let compiler: Vec<&str> = compiler.iter().map(String::as_str).collect();
    let libraries = [&compiler[..], &["--lib"]].concat();
    let readers = [&compiler[..], &["--test=all", "--", "spec_", "fuzz_", "identify_bad_input"]].concat();
    for scope in [kernels, libraries, readers] {
        let test = [&["test", "--profile=checked", "--locked", "--quiet"], &scope[..]].concat();
        let outcome = expect_success(cargo(root, &test), "see the test above");
        if !matches!(outcome, Outcome::Passed) {
            return outcome;
        }
    }
    Outcome::Passed
}

/// Tests of a separate workspace.
fn separate(root: &Path, manifest: &str) -> Outcome {
    expect_success(
        cargo(root, &["test", "--quiet", "--locked", "--all-targets", "--manifest-path", manifest]),
        "see above",
    )
}

/// Installs the cross compiler and QEMU if they are missing. Returns whether they are available.
fn set_up(root: &Path, report: &mut Report) -> bool {
    let mut there = false;
    report.step("cross compiler and QEMU", || {
        let outcome = maintained(root, &["setup"]);
        there = matches!(outcome, Outcome::Passed);
        outcome
    });
    there
}

/// Compiles the test binaries; none if that fails, which is reported.
fn compiled(root: &Path, full: bool, report: &mut Report) -> Vec<Binary> {
    let mut binaries = Vec::new();
    report.step("compiling the tests", || match binaries::compile(root, full) {
        Ok(made) => {
            binaries = made;
            Outcome::Passed
        }
        Err(why) => Outcome::Failed(why),
    });
    binaries
}

/// `cargo xtask bless`
pub fn bless(root: &Path) -> ExitCode {
    let alone = with_boards(root, &STANDING_ALONE);
    let mut report = Report::new(1 + alone.len());
    report.step("generated files", || maintained(root, &["bless"]));
    for manifest in &alone {
        report.step(&format!("lock file of {manifest}"), || {
            // Keeps locked versions; only path packages follow their manifests.
            expect_success(cargo(root, &["update", "--workspace", "--manifest-path", manifest]), "see above")
        });
    }
    report.finish()
}

fn formatting(root: &Path) -> Outcome {
    if let Err(outcome) = setup::component("rustfmt", "fmt") {
        return outcome;
    }
    // Not `--all`: specgen itself formats the emitted controller.
    let members = HAND_WRITTEN.iter().flat_map(|name| ["--package", name]);
    let alone = with_boards(root, &FORMATTED_ALONE);
    let excluded = alone.iter().map(|manifest| vec!["--manifest-path", manifest]);
    for scope in std::iter::once(members.collect()).chain(excluded) {
        let fix = format!("run: cargo fmt {}", scope.join(" "));
        let outcome = expect_success(cargo(root, &[&["fmt", "--check"], &scope[..]].concat()), &fix);
        if !matches!(outcome, Outcome::Passed) {
            return outcome;
        }
    }
    // The example of a user's own board: cargo cannot format it without the generated packages.
    let mut files = Vec::new();
    let folder = "examples/own-board/src";
    if let Err(error) = rust_files(&root.join(folder), &mut files) {
        return Outcome::Failed(format!("{folder}: {error}"));
    }
    files.sort();
    let fix = format!("run: rustfmt --edition 2024 {}", files.join(" "));
    let mut rustfmt = Command::new("rustfmt");
    rustfmt.current_dir(root).args(["--edition", "2024", "--check"]).args(&files);
    expect_success(rustfmt, &fix)
}

/// Adds all Rust files below `folder`.
fn rust_files(folder: &Path, files: &mut Vec<String>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            rust_files(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path.display().to_string());
        }
    }
    Ok(())
}

/// Lints all targets of the workspace and of the packages outside of it.
fn lints(root: &Path) -> Outcome {
    if let Err(outcome) = setup::component("clippy", "clippy") {
        return outcome;
    }
    // In release, to share build scripts and macros with the tests. Boards are linted by their own tests, in an emitted workspace.
    // In the same target folder, because most dependencies are shared.
    let alone = |manifest| ["--manifest-path", manifest, "--all-targets", "--locked", "--target-dir", "target"];
    let mut scopes = vec![vec!["--workspace", "--all-targets"]];
    scopes.extend([REAL_TIME, EMULATED].map(|manifest| alone(manifest).to_vec()));
    // These lints forbid panics that the optimiser cannot remove.
    if setup::has_target() {
        scopes.extend([FIRMWARE, TICK].map(|manifest| [&alone(manifest)[..], &["--target", TRIPLE]].concat()));
    } else {
        println!("not checked: {FIRMWARE} and {TICK}, because rustc has no target {TRIPLE}");
    }
    for scope in scopes {
        let clippy = [&["clippy", "--release", "--quiet"], &scope[..], &["--", "-D", "warnings"]].concat();
        let outcome = expect_success(cargo(root, &clippy), "fix what is reported above");
        if !matches!(outcome, Outcome::Passed) {
            return outcome;
        }
    }
    Outcome::Passed
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;

    use super::*;

    /// Files of this name that are committed, by path from the repository.
    fn named(name: &str) -> BTreeSet<String> {
        let listed = Command::new("git").current_dir(crate::root()).args(["ls-files", "-z"]).output().unwrap();
        assert!(listed.status.success(), "{listed:?}");
        let paths = String::from_utf8(listed.stdout).unwrap();
        paths
            .split('\0')
            .filter(|path| Path::new(path).file_name().is_some_and(|last| last == name))
            .map(str::to_owned)
            .collect()
    }

    /// A list that lacks a new package would silently omit it.
    #[test]
    fn no_package_is_left_out_of_a_list() {
        // It has its own step; its lock file is checked where it was generated.
        let own_board = "examples/own-board/Cargo.toml";
        let locked: BTreeSet<String> = named("Cargo.lock").iter().map(|path| path.replace(".lock", ".toml")).collect();
        assert_eq!(locked, with_boards(&crate::root(), &LOCKED).into_iter().chain([own_board.to_owned()]).collect());

        let workspace = fs::read_to_string(crate::root().join("Cargo.toml")).unwrap();
        let members = workspace.split_once("members = [").unwrap().1.split_once(']').unwrap().0;
        let members: BTreeSet<String> =
            members.split('"').skip(1).step_by(2).map(|folder| format!("{folder}/Cargo.toml")).collect();
        // The emitted controller, which specgen itself formats; and a crate of the link's tests.
        let others = ["Cargo.toml", "firmware/controller/Cargo.toml", LINK_PROOF, own_board];
        let alone =
            named("Cargo.toml").into_iter().filter(|path| !members.contains(path) && !others.contains(&path.as_str()));
        assert_eq!(alone.collect::<BTreeSet<_>>(), with_boards(&crate::root(), &FORMATTED_ALONE).into_iter().collect());
        let name = |path: &String| {
            let text = fs::read_to_string(crate::root().join(path)).unwrap();
            text.lines().find_map(|line| line.strip_prefix("name = ")).unwrap().trim_matches('"').to_owned()
        };
        let names: BTreeSet<String> =
            members.iter().map(name).filter(|name| !EMITTED.contains(&name.as_str())).collect();
        assert_eq!(names, HAND_WRITTEN.into_iter().map(str::to_owned).collect());
    }
}
