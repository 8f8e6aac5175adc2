//! What each command does, in order.

use crate::run::{Outcome, Report, cargo, expect_success};
use crate::{generated, setup};
use std::path::Path;
use std::process::ExitCode;

/// Its own workspace, built for another machine.
const FIRMWARE: &str = "firmware/qemu/Cargo.toml";

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
    report.step("tests", || {
        let tests = ["test", "--release", "--workspace", "--no-fail-fast"];
        expect_success(cargo(root, &tests), "see the failed tests above")
    });
    report.step("documentation", || {
        let mut doc = cargo(
            root,
            &["doc", "--release", "--workspace", "--no-deps", "--quiet"],
        );
        doc.env("RUSTDOCFLAGS", "-D warnings");
        expect_success(doc, "see the warnings above")
    });
    report.step("generated files are fresh", || generated::check(root));
    report.step("firmware lock file is fresh", || {
        let mut metadata = cargo(
            root,
            &[
                "metadata",
                "--locked",
                "--format-version=1",
                "--manifest-path",
                FIRMWARE,
            ],
        );
        metadata.stdout(std::process::Stdio::null());
        expect_success(metadata, "run: cargo xtask bless")
    });
    report.finish()
}

/// `cargo xtask bless`
pub fn bless(root: &Path) -> ExitCode {
    let mut report = Report::default();
    report.step("generated files", || generated::bless(root));
    report.step("firmware lock file", || {
        // Keeps the versions that are locked; only the path packages follow their manifests.
        expect_success(
            cargo(
                root,
                &["update", "--workspace", "--manifest-path", FIRMWARE],
            ),
            "see above",
        )
    });
    report.finish()
}

fn formatting(root: &Path) -> Outcome {
    if let Err(outcome) = setup::component("rustfmt", "fmt") {
        return outcome;
    }
    let mend = "run: cargo fmt --all";
    match expect_success(cargo(root, &["fmt", "--all", "--check"]), mend) {
        Outcome::Passed => expect_success(
            cargo(root, &["fmt", "--manifest-path", FIRMWARE, "--check"]),
            "run: cargo fmt --manifest-path firmware/qemu/Cargo.toml",
        ),
        other => other,
    }
}

fn lints(root: &Path) -> Outcome {
    if let Err(outcome) = setup::component("clippy", "clippy") {
        return outcome;
    }
    // In release, so that build scripts and macros are those of the tests.
    let clippy = [
        "clippy",
        "--release",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ];
    expect_success(cargo(root, &clippy), "mend what is reported above")
}
