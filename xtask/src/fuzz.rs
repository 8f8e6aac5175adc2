//! Coverage-guided fuzzing: `tests/fuzz` under libFuzzer, with debug assertions and overflow checks.
//!
//! The corpus is in `tests/fuzz/corpus`. A run writes new inputs to `target/fuzz`; `keep` reduces both to the smallest corpus with
//! the same coverage.

use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};

use crate::packages::host;
use crate::results;
use crate::run::{Outcome, Report, cargo, expect_success};

/// Its own workspace.
pub const MANIFEST: &str = "tests/fuzz/Cargo.toml";
/// Names of the targets, as in `TARGETS` of `tests/fuzz/targets`.
const TARGETS: [&str; 9] = ["spec", "csv", "mat", "hdf5", "tdms", "packed", "record", "link", "operator"];
/// The corpus, with a folder for each target.
const CORPUS: &str = "tests/fuzz/corpus";
/// Inputs of earlier runs, a folder for each target, and the build.
const WORK: &str = "target/fuzz";
/// Default time per target, s.
const SECONDS: u32 = 300;
/// Longest input, bytes; every spec of the repository fits.
const LONGEST: usize = 16_384;
/// Instrumentation for libFuzzer: edge counters and comparison traces. There is no sanitizer: the product forbids `unsafe` except
/// for a few system calls, which no target reaches.
const COVERAGE: [&str; 5] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
];

/// The work for a target.
type Work<'a> = Box<dyn Fn(&str) -> Outcome + 'a>;

/// `cargo xtask fuzz [SECONDS [TARGET]]`, `cargo xtask fuzz keep`; none if the arguments are invalid.
pub fn command(root: &Path, arguments: &[&str]) -> Option<ExitCode> {
    let mut time = None;
    let (targets, work): (Vec<&str>, Work) = match *arguments {
        ["keep"] => (TARGETS.to_vec(), Box::new(|target| keep(root, target))),
        ref all if all.len() <= 2 => {
            let seconds = all.first().map_or(Some(SECONDS), |seconds| seconds.parse().ok())?;
            time = Some(seconds);
            let targets = TARGETS.into_iter().filter(|name| all.get(1).is_none_or(|only| only == name)).collect();
            (targets, Box::new(move |target| run(root, target, seconds)))
        }
        _ => return None,
    };
    if targets.is_empty() {
        return None;
    }
    let all = targets.len() == TARGETS.len();
    let mut report = Report::new(1 + targets.len() + usize::from(all && time.is_some()));
    report.step("building the targets", || build(root));
    for target in targets {
        if !report.has_failed() {
            report.step(target, || work(target));
        }
    }
    if let (true, Some(seconds)) = (all, time) {
        let (good, targets) = (!report.has_failed(), format!("{} for {seconds} s each", TARGETS.join(", ")));
        report.step("result of the fuzzing", || results::write(root, "fuzz", good, &targets));
    }
    Some(report.finish())
}

fn build(root: &Path) -> Outcome {
    let mut build = cargo(root, &["build", "--release", "--locked", "--manifest-path", MANIFEST, "--target", &host()]);
    // With `--target`, so that build scripts and macros are not instrumented.
    build.env("CARGO_TARGET_DIR", root.join(WORK)).env("CARGO_ENCODED_RUSTFLAGS", COVERAGE.join("\u{1f}"));
    expect_success(build, "see above")
}

/// Fuzzes, starting from the corpus; new inputs are added to those of earlier runs.
fn run(root: &Path, target: &str, seconds: u32) -> Outcome {
    let (found, kept) = (root.join(WORK).join(target), root.join(CORPUS).join(target));
    let failed = root.join(WORK).join(format!("failed-{target}-"));
    if let Err(error) = fs::create_dir_all(&found).and_then(|()| fs::create_dir_all(&kept)) {
        return Outcome::Failed(format!("{}: {error}", found.display()));
    }
    let mut fuzzer = fuzzer(root, target);
    fuzzer.args([&format!("-max_total_time={seconds}"), "-print_final_stats=1", "-verbosity=0", "-timeout=10"]);
    fuzzer.arg(format!("-max_len={LONGEST}")).arg(format!("-artifact_prefix={}", failed.display()));
    fuzzer.arg(found).arg(&kept);
    let fix = format!(
        "the failing input is named above; move it to {CORPUS}/{target}, where a test repeats it: \
         cargo test --release -p specgen-tests fuzz_corpus"
    );
    expect_success(fuzzer, &fix)
}

/// Replaces the corpus with the smallest set of all inputs that has the same coverage.
fn keep(root: &Path, target: &str) -> Outcome {
    let (found, kept) = (root.join(WORK).join(target), root.join(CORPUS).join(target));
    let fresh = root.join(WORK).join(format!("kept-{target}"));
    let _ = fs::remove_dir_all(&fresh);
    if let Err(error) = fs::create_dir_all(&fresh).and_then(|()| fs::create_dir_all(&found)) {
        return Outcome::Failed(format!("{}: {error}", fresh.display()));
    }
    let mut merge = fuzzer(root, target);
    merge.args(["-set_cover_merge=1", "-use_counters=0", "-verbosity=0"]).arg(format!("-max_len={LONGEST}"));
    merge.args([&fresh, &kept, &found]);
    let outcome = expect_success(merge, "see above");
    if !matches!(outcome, Outcome::Passed) {
        return outcome;
    }
    match replace(&fresh, &kept) {
        Ok(count) => {
            println!("{count} inputs");
            Outcome::Passed
        }
        Err(error) => Outcome::Failed(format!("{}: {error}", kept.display())),
    }
}

/// Replaces the files of a folder, except inputs that once failed. Returns the number of files.
fn replace(fresh: &Path, kept: &Path) -> std::io::Result<usize> {
    for entry in fs::read_dir(kept)? {
        let entry = entry?;
        if !entry.file_name().to_string_lossy().starts_with("failed-") {
            fs::remove_file(entry.path())?;
        }
    }
    for entry in fs::read_dir(fresh)? {
        let entry = entry?;
        fs::copy(entry.path(), kept.join(entry.file_name()))?;
    }
    Ok(fs::read_dir(kept)?.count())
}

fn fuzzer(root: &Path, target: &str) -> Command {
    let program = root.join(WORK).join(host()).join("release/fuzz");
    let mut command = Command::new(program);
    command.current_dir(root).env("SPECGEN_FUZZ", target);
    command
}
