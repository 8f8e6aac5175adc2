//! What each command does, in order.

use crate::run::{Outcome, Report, cargo, expect_success};
use crate::{binaries, generated, setup};
use std::path::Path;
use std::process::ExitCode;

/// Its own workspace, built for another machine.
const FIRMWARE: &str = "firmware/qemu/Cargo.toml";
/// Built from an emitted workspace.
const HOST_LIBRARY: &str = "firmware/host/Cargo.toml";
/// Boards, each its own workspace; built from an emitted one.
const BOARDS: [&str; 2] = ["firmware/stm32h743/Cargo.toml", "firmware/stm32f4/Cargo.toml"];
/// What they share: built as a part of theirs.
const BOARDS_COMMON: &str = "firmware/stm32/Cargo.toml";
/// Its own workspace, because of its dependencies.
const REAL_TIME: &str = "firmware/rt-pc/Cargo.toml";
/// Its own workspace, because of its dependencies too.
const SCHEMA: &str = "tests/schema/Cargo.toml";
/// Members of the workspace that people write.
const HAND_WRITTEN: [&str; 9] = [
    "specgen",
    "specgen-runtime",
    "specgen-hal",
    "specgen-link",
    "specgen-board",
    "specgen-rt",
    "host-sim",
    "specgen-tests",
    "xtask",
];

/// `cargo xtask setup`
pub fn setup() -> ExitCode {
    let mut report = Report::default();
    report.step("cross compiler and QEMU", setup::microcontroller);
    report.finish()
}

/// `cargo xtask test`
pub fn test(root: &Path) -> ExitCode {
    let mut report = Report::default();
    report.step("cross compiler and QEMU", setup::microcontroller);
    if report.has_failed() {
        // Every test that needs them would fail for the same reason.
        return report.finish();
    }
    report.step("formatting", || formatting(root));
    report.step("lints", || lints(root));
    report.step("tests", || binaries::test(root));
    report.step("published schema", || {
        expect_success(cargo(root, &["test", "--quiet", "--locked", "--manifest-path", SCHEMA]), "see the test above")
    });
    report.step("documentation", || {
        let mut doc = cargo(root, &["doc", "--release", "--workspace", "--no-deps", "--quiet"]);
        doc.env("RUSTDOCFLAGS", "-D warnings");
        expect_success(doc, "see the warnings above")
    });
    report.step("generated files are fresh", || generated::check(root));
    for manifest in [FIRMWARE, REAL_TIME].iter().chain(&BOARDS) {
        report.step(&format!("lock file of {manifest} is fresh"), || {
            let mut metadata =
                cargo(root, &["metadata", "--locked", "--format-version=1", "--manifest-path", manifest]);
            metadata.stdout(std::process::Stdio::null());
            expect_success(metadata, "run: cargo xtask bless")
        });
    }
    report.finish()
}

/// `cargo xtask bless`
pub fn bless(root: &Path) -> ExitCode {
    let mut report = Report::default();
    report.step("generated files", || generated::bless(root));
    for manifest in [FIRMWARE, REAL_TIME].iter().chain(&BOARDS) {
        report.step(&format!("lock file of {manifest}"), || {
            // Keeps the versions that are locked; only the path packages follow their manifests.
            expect_success(cargo(root, &["update", "--workspace", "--manifest-path", manifest]), "see above")
        });
    }
    report.finish()
}

fn formatting(root: &Path) -> Outcome {
    if let Err(outcome) = setup::component("rustfmt", "fmt") {
        return outcome;
    }
    // Not `--all`: the emitted controller is formatted by specgen itself.
    let members = HAND_WRITTEN.iter().flat_map(|name| ["--package", name]);
    let excluded = [FIRMWARE, HOST_LIBRARY, REAL_TIME, BOARDS_COMMON, SCHEMA].into_iter().chain(BOARDS);
    let excluded = excluded.map(|manifest| vec!["--manifest-path", manifest]);
    for scope in std::iter::once(members.collect()).chain(excluded) {
        let mend = format!("run: cargo fmt {}", scope.join(" "));
        let outcome = expect_success(cargo(root, &[&["fmt", "--check"], &scope[..]].concat()), &mend);
        if !matches!(outcome, Outcome::Passed) {
            return outcome;
        }
    }
    Outcome::Passed
}

fn lints(root: &Path) -> Outcome {
    if let Err(outcome) = setup::component("clippy", "clippy") {
        return outcome;
    }
    // In release, so that build scripts and macros are those of the tests.
    let clippy = ["clippy", "--release", "--workspace", "--all-targets", "--", "-D", "warnings"];
    expect_success(cargo(root, &clippy), "mend what is reported above")
}
