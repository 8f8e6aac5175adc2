//! Runs every test of the workspace, one binary per package, in parallel by modules.
//!
//! `cargo test` runs one binary after the other, and at the end of each all processors but one wait for its longest test. Here a
//! job is a module of a binary, so that its tests share their fixtures. The longest jobs start first. Each prints one line.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crate::builds::{Builds, MOST};
use crate::progress::{Durations, Progress};
use crate::run::{Outcome, cargo};
use crate::{setup, skips};

/// Mode of a test run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mode {
    /// Run every test at full length, including long tests.
    pub full: bool,
    /// The cross compiler or the emulator is missing, as an earlier step reported: skip what needs it.
    pub tools_missing: bool,
}

/// Modules whose tests mostly wait, for time or for another process.
const WAITING: [&str; 7] = [
    "cli all::rt_pc",
    "cli all::operate",
    "cli all::kills",
    "cli all::interrupt",
    "cli all::pil",
    "cli all::files",
    "operate::gcs",
];

/// Packages without tests; their libraries, or what only benchmarks depend on, would be compiled for nothing.
const WITHOUT_TESTS: [&str; 4] = ["controller", "controller-with-passes", "specgen-law", "specgen-benches"];
/// Packages whose own tests take seconds, but need 5 to 54 CPU-seconds each to compile. They are tested only in the full run; the
/// short run tests them through the command and across crates. The oracle's own tests hold it and the simulated machine against the
/// study; the short run holds the controller against the oracle.
const LONG_TO_COMPILE: [&str; 11] = [
    "specgen-runtime",
    "specgen-numerics",
    "specgen-run-time",
    "specgen-identify",
    "specgen-language",
    "specgen-toolchain",
    "host-sim",
    "specgen-studies",
    "specgen-report",
    "specgen-board-passes",
    "oracle",
];

/// The environment variable that selects the full length of tests.
const FULL: &str = "SPECGEN_FULL";

/// Results of a test run.
#[derive(Debug, Default)]
pub struct TestResults {
    /// `package::module::test`, sorted, with whether it passed.
    pub tests: Vec<(String, bool)>,
    /// Tests, or parts of one, that were skipped: job, reason.
    pub skipped: Vec<(String, String)>,
}

/// Compiles every test binary of the workspace, those of [`LONG_TO_COMPILE`] only for a `full` run. Cargo prints the errors.
pub fn compile(root: &Path, full: bool) -> Result<Vec<Binary>, String> {
    let arguments = ["test", "--release", "--workspace", "--no-run", "--message-format=json-render-diagnostics"];
    let left_out = WITHOUT_TESTS.iter().chain(LONG_TO_COMPILE.iter().filter(|_| !full));
    let without = left_out.flat_map(|package| ["--exclude", package]);
    let lengthy = ["--config", "profile.release.package.specgen-tests.opt-level=2"];
    let output = cargo(root, &arguments)
        .args(without)
        // The tests' own code checks millions of ticks.
        .args(lengthy.into_iter().filter(|_| full))
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("cargo cannot be run: {error}"))?;
    if !output.status.success() {
        return Err(format!("{}; see the errors above", output.status));
    }
    let mut binaries: Vec<Binary> = String::from_utf8_lossy(&output.stdout).lines().filter_map(Binary::of).collect();
    binaries.sort_by(|a, b| a.name.cmp(&b.name));
    if binaries.is_empty() {
        return Err("cargo named no test binary".to_owned());
    }
    Ok(binaries)
}

/// Runs the tests, then checks what was skipped.
pub fn test(root: &Path, binaries: &[Binary], mode: Mode, ran: &mut TestResults) -> Outcome {
    let kept = root.join("target/tests");
    let last = kept.join(if mode.full { "durations-full.json" } else { "durations.json" });
    let durations = Durations::read(&last, mode.full);
    let jobs = match jobs(binaries, &durations, mode.full) {
        Ok(jobs) => jobs,
        Err(why) => return Outcome::Failed(why),
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    // Remove files of earlier runs. An error does not matter, as names are not reused.
    let _ = std::fs::remove_dir_all(kept.join("scratch"));
    println!("{} modules of {} test binaries, {workers} at a time", jobs.len(), binaries.len());
    let begun = SystemTime::now();
    let done = run(&jobs, workers, &kept, &durations, mode);
    let builds = Builds::since(&kept.join("cache/builds"), begun);
    Durations::of(done.iter().map(|ended| (ended.name.clone(), ended.took))).write(&last);
    let mut failed = Vec::new();
    for ended in done {
        if !ended.good {
            failed.push(ended.name.clone());
        }
        ran.tests.extend(ended.tests);
        ran.skipped.extend(ended.skipped.into_iter().map(|why| (ended.name.clone(), why)));
    }
    ran.tests.sort();
    ran.skipped.sort();
    let skipped = skips::judge(root, &ran.skipped);
    let good = ran.tests.iter().filter(|(_, good)| *good).count();
    println!("\ntests: {good} passed, {} failed, {} skipped", ran.tests.len() - good, ran.skipped.len());
    println!(
        "controllers built or taken from the cache: {} host libraries, {} images",
        builds.libraries, builds.images
    );
    if failed.is_empty() && !mode.full && builds.libraries > MOST {
        return Outcome::Failed(format!(
            "{} host libraries, more than {MOST}: let tests run the law on the compiled spec (`at_run_time`)",
            builds.libraries
        ));
    }
    if failed.is_empty() {
        return skipped;
    }
    failed.sort();
    Outcome::Failed(format!("see the failed tests above: {}", failed.join(", ")))
}

/// Runs the examples in the documentation, and shows the output only if one fails.
pub fn examples(root: &Path) -> Outcome {
    // Its examples name the crate `controller`; with `--doc`, cargo does not read `doctest = false`.
    let without = "--exclude=controller-with-passes";
    match cargo(root, &["test", "--release", "--workspace", without, "--doc", "--quiet"]).output() {
        Ok(output) if output.status.success() => Outcome::Passed,
        Ok(output) => {
            let text = [output.stdout, output.stderr].concat();
            println!("{}", String::from_utf8_lossy(&text).trim());
            Outcome::Failed("see the failed examples above".to_owned())
        }
        Err(error) => Outcome::Failed(format!("cargo cannot be run: {error}")),
    }
}

/// A compiled test binary.
pub struct Binary {
    /// Package and target, such as `specgen-tests all`; only the package for its library.
    name: String,
    executable: PathBuf,
    /// Folder of its package, where cargo would run it.
    folder: PathBuf,
}

impl Binary {
    /// The test binary in a message of cargo, if there is one.
    fn of(line: &str) -> Option<Self> {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        if message["reason"] != "compiler-artifact" || message["profile"]["test"] != true {
            return None;
        }
        let manifest = Path::new(message["manifest_path"].as_str()?);
        let folder = manifest.parent()?.to_owned();
        let package = folder.file_name()?.to_string_lossy().into_owned();
        let target = message["target"]["name"].as_str()?;
        let library = message["target"]["kind"].as_array()?.iter().any(|kind| kind == "lib");
        Some(Self {
            name: if library { package } else { format!("{package} {target}") },
            executable: message["executable"].as_str()?.into(),
            folder,
        })
    }

    /// Paths of its tests, including ignored ones in a `full` run.
    fn tests(&self, full: bool) -> Result<Vec<String>, String> {
        let list = |more: &[&str]| -> Result<Vec<String>, String> {
            let mut command = Command::new(&self.executable);
            command.current_dir(&self.folder).args(["--list", "--format", "terse"]).args(more);
            let output = command.output().map_err(|error| format!("{}: {error}", self.name))?;
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            Ok(text.lines().filter_map(|line| line.strip_suffix(": test")).map(str::to_owned).collect())
        };
        let ignored = if full { Vec::new() } else { list(&["--ignored"])? };
        Ok(list(&[])?.into_iter().filter(|test| !ignored.contains(test)).collect())
    }
}

/// A module of a binary.
struct Job<'a> {
    /// Such as `tests all::platform_tables`.
    name: String,
    binary: &'a Binary,
    tests: Vec<String>,
}

/// The jobs, longest first: a long job that starts last would run alone.
fn jobs<'a>(binaries: &'a [Binary], durations: &Durations, full: bool) -> Result<Vec<Job<'a>>, String> {
    let mut jobs = Vec::new();
    for binary in binaries {
        let mut modules: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for test in binary.tests(full)? {
            let module = test.split_once("::").map_or("", |(module, _)| module);
            modules.entry(module.to_owned()).or_default().push(test);
        }
        jobs.extend(modules.into_iter().map(|(module, tests)| {
            let name = if module.is_empty() { binary.name.clone() } else { format!("{}::{module}", binary.name) };
            Job { name, binary, tests }
        }));
    }
    jobs.sort_by(|a, b| durations.expect(&b.name).cmp(&durations.expect(&a.name)).then_with(|| a.name.cmp(&b.name)));
    Ok(jobs)
}

/// Result of a job.
struct JobResult {
    name: String,
    good: bool,
    took: Duration,
    tests: Vec<(String, bool)>,
    skipped: Vec<String>,
}

/// Runs jobs, and prints a line for each, with its output if it failed. There is one worker per processor, and another for jobs
/// that mostly wait; idle workers help with those.
fn run(jobs: &[Job<'_>], workers: usize, kept: &Path, durations: &Durations, mode: Mode) -> Vec<JobResult> {
    let (waiting, computing): (Vec<usize>, Vec<usize>) =
        (0..jobs.len()).partition(|index| WAITING.contains(&jobs[*index].name.as_str()));
    let queues = [computing, waiting].map(|queue| Mutex::new(VecDeque::from(queue)));
    let take = |queue: &Mutex<VecDeque<usize>>| queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
    let next = &|worker: usize| match worker {
        _ if worker < workers => take(&queues[0]).or_else(|| take(&queues[1])),
        _ => take(&queues[1]),
    };
    let expected: Vec<Duration> = jobs.iter().map(|job| durations.expect(&job.name)).collect();
    let done = Mutex::new((Vec::new(), Progress::new(expected, workers)));
    let work = &|worker: usize| {
        while let Some(index) = next(worker) {
            let job = &jobs[index];
            let start = Instant::now();
            let (good, text) = job.run(kept, mode, worker);
            let ended = job.ended(good, &text, start.elapsed());
            // Under a lock, so that outputs do not mix. A poisoned lock would mean that printing panicked.
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            let (list, progress) = &mut *done;
            let line = progress.ended(index, ended.took);
            let word = if ended.good { "ok" } else { "FAILED" };
            println!("{line}  {word:6}  {} ({}, {:.1} s)", job.name, ended.tests.len(), ended.took.as_secs_f64());
            if !ended.good {
                println!("{}\n", text.trim());
            }
            list.push(ended);
        }
    };
    std::thread::scope(|scope| {
        for worker in 0..=workers {
            scope.spawn(move || work(worker));
        }
    });
    done.into_inner().unwrap_or_else(PoisonError::into_inner).0
}

impl Job<'_> {
    /// Runs the tests one at a time, because other processors have other jobs. Returns whether all passed, and the output.
    fn run(&self, kept: &Path, mode: Mode, worker: usize) -> (bool, String) {
        let mut command = Command::new(&self.binary.executable);
        // Variables that cargo would set.
        command
            .current_dir(&self.binary.folder)
            .env("CARGO_MANIFEST_DIR", &self.binary.folder)
            .env("SPECGEN_CACHE", kept.join("cache"))
            .env("SPECGEN_TEST_WORKER", worker.to_string())
            .args(["--show-output", "--test-threads=1", "--exact"])
            .args(&self.tests)
            .stdin(Stdio::null());
        if mode.full {
            command.env(FULL, "1").arg("--include-ignored");
        }
        if !mode.tools_missing {
            command.env(setup::REQUIRE_TOOLS, "1");
        }
        match command.output() {
            Ok(output) => {
                let text = [output.stdout, output.stderr].concat();
                (output.status.success(), String::from_utf8_lossy(&text).into_owned())
            }
            Err(error) => (false, error.to_string()),
        }
    }

    fn ended(&self, good: bool, text: &str, took: Duration) -> JobResult {
        let failed = |test: &str| !text.lines().any(|line| line == format!("test {test} ... ok"));
        JobResult {
            name: self.name.clone(),
            // A binary that finds none of the named tests also succeeds.
            good: good && passed(text) == Some(self.tests.len()),
            took,
            tests: self.tests.iter().map(|test| (format!("{} {test}", self.binary.name), !failed(test))).collect(),
            skipped: skips::of(text),
        }
    }
}

/// Number of passed tests in a binary's own summary, which comes after the output of the tests.
fn passed(text: &str) -> Option<usize> {
    let counts = text.lines().rev().filter_map(|line| line.strip_prefix("test result: ok. ")?.split_once(" passed"));
    counts.map(|(count, _)| count.parse().ok()).next()?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_run_takes_the_long_tests_too_and_the_short_run_takes_none() {
        let executable = std::env::current_exe().unwrap();
        let binary = Binary { name: "xtask".to_owned(), executable, folder: PathBuf::from(".") };
        let [short, full] = [false, true].map(|full| binary.tests(full).unwrap());
        let more: Vec<&String> = full.iter().filter(|test| !short.contains(test)).collect();
        assert_eq!(more, ["binaries::tests::a_long_test"]);
        assert!(short.iter().all(|test| full.contains(test)));
    }

    #[test]
    #[ignore = "long: used by the test above; it fails in a run that is not full"]
    fn a_long_test() {
        assert!(std::env::var_os(FULL).is_some(), "{FULL} is not set");
    }

    #[test]
    fn packages_without_tests_have_none() {
        let root = crate::root();
        let mut open =
            ["firmware/controller", "firmware/board/tests/passes/controller", "firmware/law", "tests/benches"]
                .map(|path| root.join(path))
                .to_vec();
        assert_eq!(open.len(), WITHOUT_TESTS.len());
        let mut files = 0;
        while let Some(path) = open.pop() {
            if path.is_dir() {
                open.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files += 1;
                assert!(!std::fs::read_to_string(&path).unwrap().contains("#[test]"), "{}", path.display());
            }
        }
        assert!(files > 50, "{files}");
    }

    #[test]
    fn tests_that_were_not_run_have_not_passed() {
        let binary = Binary { name: "a all".to_owned(), executable: PathBuf::new(), folder: PathBuf::new() };
        let tests = ["m::x", "m::y"].map(str::to_owned).to_vec();
        let job = Job { name: "a all::m".to_owned(), binary: &binary, tests };
        let is_good = |good: bool, text: &str| job.ended(good, text, Duration::ZERO).good;
        let printed = "test m::x ... ok\n\nsuccesses:\ntest result: ok. 6 passed; 0 failed\n\n";
        let result = |count: u32| format!("{printed}test result: ok. {count} passed; 0 failed; 0 ignored\n");
        assert!(is_good(true, &result(2)));
        assert!(!is_good(false, &result(2)));
        for text in [&result(0), &result(1), "", "running 0 tests\n"] {
            assert!(!is_good(true, text), "{text}");
        }
    }
}
