//! The Python package: builds its wheel, and tests it in a virtual environment like those of users.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::run::{Outcome, Report, cargo, expect_success};

/// A separate workspace, because no other build needs Python.
pub const MANIFEST: &str = "codegen/python/Cargo.toml";
pub const FOLDER: &str = "codegen/python";
/// Output folder.
const MADE: &str = "target/wheel";
/// Virtual environment of the build tools.
pub const TOOLS: &str = "target/wheel/tools";

/// `cargo xtask wheel`
pub fn command(root: &Path) -> ExitCode {
    let mut report = Report::new(9);
    let made = root.join(MADE);
    let (tools, fresh, wheels) = (root.join(TOOLS), made.join("fresh"), made.join("dist"));
    report.step("tools", || environment(&tools, &[OsStr::new("-r"), root.join(FOLDER).join("tools.txt").as_ref()]));
    report.step("wheel", || build(root, &tools, &wheels, |_| {}));
    if report.has_failed() {
        return report.finish();
    }
    report.step("the command", || expect_success(cargo(root, &["build", "--release", "--locked"]), "see above"));
    report.step("fresh environment", || match wheel(&wheels) {
        // With fixed versions of the test tools, so that results are the same everywhere.
        Ok(wheel) => environment(
            &fresh,
            &[wheel.as_ref(), OsStr::new("-r"), root.join(FOLDER).join("tests/requirements.txt").as_ref()],
        ),
        Err(why) => Outcome::Failed(why),
    });
    let python = |arguments: &[&str]| {
        let mut python = Command::new(fresh.join("bin/python"));
        // Not in the folder of the sources, which would be imported.
        python.current_dir(root).args(arguments);
        python.env("SPECGEN_COMMAND", target(root).join("release/specgen"));
        python
    };
    let tests = format!("{FOLDER}/tests");
    report.step("tests", || expect_success(python(&["-m", "pytest", "-q", &tests]), "see the test above"));
    let config = format!("--config-file={FOLDER}/pyproject.toml");
    report.step("types", || {
        expect_success(python(&["-m", "mypy", &config, "-p", "specgen"]), "fix what is reported above")
    });
    report.step("types of the tests", || {
        expect_success(python(&["-m", "mypy", &config, &tests]), "fix what is reported above")
    });
    report.step("types of the native module", || {
        expect_success(python(&["-m", "mypy.stubtest", "specgen"]), "correct codegen/python/specgen/_native.pyi")
    });
    report.step("lints", || {
        let clippy =
            ["clippy", "--release", "--quiet", "--locked", "--manifest-path", MANIFEST, "--", "-D", "warnings"];
        let mut clippy = cargo(root, &clippy);
        clippy.env("CARGO_TARGET_DIR", target(root));
        expect_success(clippy, "fix what is reported above")
    });
    report.finish()
}

/// Creates a new virtual environment with these packages.
pub fn environment(folder: &Path, packages: &[&OsStr]) -> Outcome {
    let mut python = Command::new("python3");
    python.args(["-m", "venv", "--clear"]).arg(folder);
    match expect_success(
        python,
        "python3 3.11 or newer with the module venv is required (Debian: apt-get install python3-venv)",
    ) {
        Outcome::Passed => {}
        other => return other,
    }
    let mut pip = Command::new(folder.join("bin/python"));
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
    expect_success(pip, "see above")
}

/// Builds the wheel; `more` can add to the builder's arguments and environment.
pub fn build(root: &Path, tools: &Path, wheels: &Path, more: impl FnOnce(&mut Command)) -> Outcome {
    if let Err(error) = fs::remove_dir_all(wheels)
        && error.kind() != std::io::ErrorKind::NotFound
    {
        return Outcome::Failed(format!("{}: {error}", wheels.display()));
    }
    let mut maturin = Command::new(tools.join("bin/maturin"));
    maturin
        .current_dir(root)
        .args(["build", "--release", "--locked", "--manifest-path", MANIFEST, "--out"])
        .arg(wheels);
    // It shares most packages with the command.
    maturin.env("CARGO_TARGET_DIR", target(root));
    more(&mut maturin);
    expect_success(maturin, "see above")
}

/// The wheel in a folder.
pub fn wheel(folder: &Path) -> Result<PathBuf, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    paths.find(|path| path.extension() == Some(OsStr::new("whl"))).ok_or_else(|| "there is no wheel".to_owned())
}

/// Cargo's target folder.
fn target(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from)
}
