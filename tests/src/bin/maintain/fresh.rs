//! `cargo xtask fresh`: runs the commands of a newcomer on clean machines.
//!
//! Each scenario is a minimal Debian made by debootstrap, with a C linker and a copy of this machine's Rust toolchain, without
//! its target for microcontrollers. The repository is cloned into it at HEAD, and the two commands of the README are run there.

mod root;

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use root::{Caller, Root};
use specgen_language::interrupt;

/// The README's main job.
const MAIN_JOB: &str = "cargo run --release -- specs/reference.toml -o out/reference --setup";
/// The README's tests.
const TESTS: &str = "cargo xtask test";
/// Folder for the output of scenarios, below the repository.
const KEPT: &str = "target/fresh";
/// Exit code after Ctrl-C, as in shells.
const INTERRUPTED: u8 = 130;

const USAGE: &str = "usage: cargo xtask fresh [--main-job-only] [SCENARIO…]

The README's two commands in minimal Debian roots, each a clone of HEAD. Needs root, debootstrap, rustup, and some 5 GB in the
folder for temporary files. A scenario takes about 5 minutes, with the tests about 20 more.

  --main-job-only   without the tests

Scenarios:";

/// The user who runs the commands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum User {
    Root,
    /// A user without sudo.
    Plain,
    /// A user with password-less sudo.
    Sudo,
}

/// A machine and its user.
struct Scenario {
    name: &'static str,
    suite: &'static str,
    user: User,
    /// Whether a package is installed that apt would have to remove to install the emulator.
    conflict: bool,
    /// Whether the main job has no network; cargo's packages are fetched before.
    offline: bool,
}

const SCENARIOS: [Scenario; 7] = [
    Scenario { name: "bookworm-root", suite: "bookworm", user: User::Root, conflict: false, offline: false },
    Scenario { name: "bookworm-user", suite: "bookworm", user: User::Plain, conflict: false, offline: false },
    Scenario { name: "bookworm-conflict", suite: "bookworm", user: User::Root, conflict: true, offline: false },
    Scenario { name: "bookworm-offline", suite: "bookworm", user: User::Plain, conflict: false, offline: true },
    Scenario { name: "trixie-root", suite: "trixie", user: User::Root, conflict: false, offline: false },
    Scenario { name: "trixie-user", suite: "trixie", user: User::Plain, conflict: false, offline: false },
    Scenario { name: "trixie-sudo", suite: "trixie", user: User::Sudo, conflict: false, offline: false },
];

/// Result of a command.
struct CommandResult {
    code: i32,
    took: Duration,
    printed: String,
}

/// Result of a scenario.
struct Line {
    name: &'static str,
    job: Option<CommandResult>,
    tests: Option<CommandResult>,
    /// The failure, if any.
    wrong: Option<String>,
}

/// Usage.
pub fn usage() -> String {
    let names: Vec<&str> = SCENARIOS.iter().map(|scenario| scenario.name).collect();
    format!("{USAGE} {}", names.join(", "))
}

/// `cargo xtask fresh`
pub fn fresh(repository: &Path, arguments: &[&str]) -> ExitCode {
    let (options, names): (Vec<&str>, Vec<&str>) = arguments.iter().partition(|word| word.starts_with('-'));
    let unknown_name = names.iter().find(|name| SCENARIOS.iter().all(|scenario| scenario.name != **name));
    let unknown = options.iter().find(|option| **option != "--main-job-only").or(unknown_name);
    if let Some(word) = unknown {
        eprintln!("error: `{word}` is neither an option nor a scenario\n\n{}", usage());
        return ExitCode::from(2);
    }
    let caller = match Caller::look() {
        Ok(caller) => caller,
        Err(why) => {
            eprintln!("error: {why}");
            return ExitCode::from(3);
        }
    };
    // Roots are also removed after Ctrl-C: their processes are ended first.
    interrupt::catch(|| INTERRUPTED);
    let pressed = interrupt::heed();
    let mut lines = Vec::new();
    for scenario in SCENARIOS.iter().filter(|scenario| names.is_empty() || names.contains(&scenario.name)) {
        lines.push(run(scenario, &caller, repository, !options.is_empty()));
        if pressed.load(Ordering::SeqCst) {
            return ExitCode::from(INTERRUPTED);
        }
    }
    println!("\n=== summary\n{:20}{:>9}{:>9}  {:34}{:>6}{:>9}", "scenario", "main job", "s", "bits", "tests", "s");
    for line in &lines {
        let of = |ran: &Option<CommandResult>| {
            let text = |ran: &CommandResult| (ran.code.to_string(), format!("{:.0}", ran.took.as_secs_f64()));
            ran.as_ref().map_or(("-".to_owned(), "-".to_owned()), text)
        };
        let ((job, job_s), (tests, tests_s)) = (of(&line.job), of(&line.tests));
        let bits = line.job.as_ref().map_or("-", |ran| compared(&ran.printed));
        println!("{:20}{job:>9}{job_s:>9}  {bits:34}{tests:>6}{tests_s:>9}", line.name);
    }
    for line in &lines {
        if let Some(wrong) = &line.wrong {
            println!("FAILED: {}: {wrong}", line.name);
        }
    }
    if lines.iter().all(|line| line.wrong.is_none()) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The number of compared bits that the main job prints.
fn compared(printed: &str) -> &str {
    let agree = printed.lines().find_map(|line| line.split_once(" agree in every bit over "));
    agree.map_or("none", |(_, ticks)| ticks)
}

fn run(scenario: &Scenario, caller: &Caller, repository: &Path, job_only: bool) -> Line {
    println!("\n=== {}", scenario.name);
    let mut line = Line { name: scenario.name, job: None, tests: None, wrong: None };
    line.wrong = go(scenario, caller, repository, job_only, &mut line).err();
    if let Some(wrong) = &line.wrong {
        println!("FAILED: {wrong}");
    }
    line
}

/// Runs a scenario.
fn go(scenario: &Scenario, caller: &Caller, repository: &Path, job_only: bool, line: &mut Line) -> Result<(), String> {
    println!("making a root of {}", scenario.suite);
    let root = Root::new(scenario.suite, caller)?;
    if scenario.user == User::Sudo {
        root.install(&["sudo"])?;
        root.write("etc/sudoers.d/user", "user ALL=(ALL) NOPASSWD: ALL\n")?;
    }
    if scenario.conflict {
        root.conflict("qemu-utils", "qemu-system-arm")?;
    }
    let home = root.home(scenario.user == User::Root, caller)?;
    home.clone(repository)?;
    if scenario.offline {
        home.expect_success("cargo fetch --locked")?;
    }
    let kept = repository.join(KEPT);
    let command = |words: &str, offline: bool, name: &str| -> Result<CommandResult, String> {
        println!("running: {words}");
        let start = Instant::now();
        let (code, printed) = home.run(words, offline)?;
        let took = start.elapsed();
        let file = kept.join(format!("{}-{name}.txt", scenario.name));
        let written = std::fs::create_dir_all(&kept).and_then(|()| std::fs::write(&file, &printed));
        written.map_err(|error| format!("{}: {error}", file.display()))?;
        println!("exit code {code} after {:.0} s; all that it printed: {}", took.as_secs_f64(), file.display());
        Ok(CommandResult { code, took, printed })
    };

    let job = line.job.insert(command(MAIN_JOB, scenario.offline, "main-job")?);
    for said in job.printed.lines().filter(|line| is_telling(line)) {
        println!("  {}", said.trim());
    }
    let expected_bits = if scenario.offline { "none" } else { "20,000 ticks" };
    if job.code != 0 {
        return Err(format!("the main job ends with {}: {}", job.code, job.printed.lines().last().unwrap_or_default()));
    }
    if compared(&job.printed) != expected_bits {
        return Err(format!("bits compared: {}, expected: {expected_bits}", compared(&job.printed)));
    }
    if !job.printed.contains("host library: ") || (scenario.offline && !job.printed.contains("skipped: ")) {
        return Err("the main job does not say that the host library was built, or what was skipped".to_owned());
    }
    for file in [
        "controller/src/lib.rs",
        "law/src/platform/step.rs",
        "runtime/Cargo.toml",
        "host/Cargo.toml",
        "qemu/Cargo.toml",
    ] {
        home.expect_file(&format!("out/reference/{file}"))?;
    }
    // Offline, tests that need the emulator cannot pass.
    if !job_only && !scenario.offline {
        let tests = line.tests.insert(command(TESTS, false, "tests")?);
        if tests.code != 0 {
            return Err(format!("the tests end with {}", tests.code));
        }
    }
    Ok(())
}

/// Whether a line of the main job reports how a tool was found.
fn is_telling(line: &str) -> bool {
    const STARTS: [&str; 9] = [
        "running: ",
        "rustup target add: ",
        "apt-get install: ",
        "unpacked packages: ",
        "downloading ",
        "cross compiler: ",
        "emulator: ",
        "skipped: ",
        "bits ",
    ];
    STARTS.iter().any(|start| line.trim_start().starts_with(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commands_are_those_of_the_readme() {
        let readme = include_str!("../../../../README.md");
        assert!(readme.contains(MAIN_JOB) && readme.contains(TESTS));
    }

    #[test]
    fn the_comparison_is_read_from_what_is_printed() {
        let printed = "  a\n  bits     host and mps2-an500 agree in every bit over 20,000 ticks\n";
        assert_eq!(compared(printed), "20,000 ticks");
        assert_eq!(compared("  bits     host and mps2-an500 DIFFER: x\n"), "none");
    }
}
