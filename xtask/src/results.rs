//! Results of the last long runs, as a committed file: a line for each command, with date, commit and result.
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::binaries::TestResults;
use crate::run::Outcome;

/// The file.
const FILE: &str = "tests/results.txt";
const HEAD: &str =
    "# Written by `cargo xtask test --full`, `fuzz` and `mutants`: date, commit and result of the last run of each.\n";
/// Largest age of the full run, in commits.
const OLDEST: usize = 60;
/// The command whose age is checked.
pub const FULL: &str = "full";

/// Writes the line of a command, with its result and findings, in place of its earlier line.
pub fn write(root: &Path, command: &str, good: bool, found: &str) -> Outcome {
    let commit = git(root, &["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    // A change of the file itself does not affect the tests.
    let others = format!(":!{FILE}");
    let status = git(root, &["status", "--porcelain", "--untracked-files=no", "--", ".", &others]);
    let changed = if status.is_none_or(|text| !text.is_empty()) { " with changes" } else { "" };
    let today = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let word = if good { "good" } else { "FAILED" };
    let line = format!("{command:8} {} {commit}{changed} {word}, {found}", date(today));
    println!("{line}");
    let text = with(&std::fs::read_to_string(root.join(FILE)).unwrap_or_default(), command, &line);
    match std::fs::write(root.join(FILE), text) {
        Ok(()) => Outcome::Passed,
        Err(error) => Outcome::Failed(format!("{FILE}: {error}")),
    }
}

/// A file of results with one line replaced or added.
fn with(text: &str, command: &str, line: &str) -> String {
    let mut lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#') && of(line) != command).collect();
    lines.push(line);
    lines.sort_unstable();
    lines.into_iter().fold(HEAD.to_owned(), |text, line| text + line + "\n")
}

fn of(line: &str) -> &str {
    line.split(' ').next().unwrap_or_default()
}

/// Numbers of passed, failed and skipped tests, the duration, and a digest of all tests with their results.
pub fn of_tests(ran: &TestResults, took: Duration) -> String {
    let mut results = String::new();
    for (name, passed) in &ran.tests {
        results += &format!("{} {name}\n", if *passed { "ok" } else { "failed" });
    }
    for (job, why) in &ran.skipped {
        results += &format!("skipped {job}: {why}\n");
    }
    let passed = ran.tests.iter().filter(|(_, passed)| *passed).count();
    let (failed, skipped, minutes) = (ran.tests.len() - passed, ran.skipped.len(), took.as_secs_f64() / 60.0);
    let digest = &crate::sha256(results.as_bytes())[..16];
    format!("{passed} passed, {failed} failed, {skipped} skipped, {minutes:.0} min, sha256 {digest}")
}

/// Shows the result of the last full run, and checks its age if the history is available.
pub fn judge(root: &Path) -> Outcome {
    let text = std::fs::read_to_string(root.join(FILE)).unwrap_or_default();
    let Some(line) = text.lines().find(|line| of(line) == FULL) else {
        return Outcome::Skipped(format!("{FILE} has no result of a full run yet; run: cargo xtask test --full"));
    };
    println!("{line}");
    let shallow = git(root, &["rev-parse", "--is-shallow-repository"]);
    if shallow.is_none_or(|answer| answer != "false") {
        return Outcome::Skipped("its age is unknown: this is not a clone with the whole history".to_owned());
    }
    let commit = line.split_whitespace().nth(2).unwrap_or_default();
    let age = git(root, &["rev-list", "--count", &format!("{commit}..HEAD")]).and_then(|count| count.parse().ok());
    verdict(age)
}

/// Verdict on the age of the full run in commits, none if its commit is not in the history.
fn verdict(age: Option<usize>) -> Outcome {
    let again = format!("run `cargo xtask test --full` and commit {FILE}");
    match age {
        None => Outcome::Failed(format!("the commit of the last full run is not in the history; {again}")),
        Some(age) if age > OLDEST => {
            Outcome::Failed(format!("the last full run is {age} commits old, more than {OLDEST}; {again}"))
        }
        Some(_) => Outcome::Passed,
    }
}

/// Uncommitted changes; none if this is not a clone.
pub fn changes(root: &Path) -> Option<String> {
    git(root, &["status", "--porcelain"])
}

/// Checks that the tests have not changed the clone.
pub fn unchanged(before: Option<&str>, after: Option<&str>) -> Outcome {
    if before == after {
        return Outcome::Passed;
    }
    Outcome::Failed(format!("the tests changed the clone; git status now says:\n{}", after.unwrap_or_default()))
}

fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").current_dir(root).args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Year, month and day of the n-th day since 1970-01-01 (Howard Hinnant, "chrono-compatible low-level date algorithms").
fn date(days: u64) -> String {
    let shifted = days + 719_468;
    let era = shifted / 146_097;
    let day_of_era = shifted % 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (days, expected) in
            [(0, "1970-01-01"), (11_016, "2000-02-29"), (19_782, "2024-02-29"), (20_779, "2026-11-22")]
        {
            assert_eq!(date(days), expected);
        }
    }

    #[test]
    fn one_result_that_differs_changes_the_digest() {
        let ran = |passed| TestResults { tests: vec![("tests a".to_owned(), passed)], skipped: Vec::new() };
        let of = |passed| of_tests(&ran(passed), Duration::from_secs(60));
        assert_ne!(of(true), of(false));
        assert!(of(true).starts_with("1 passed, 0 failed, 0 skipped, 1 min, sha256 "), "{}", of(true));
    }

    #[test]
    fn a_line_replaces_that_of_its_command_alone() {
        let text = with(&with(&with("", "full", "full a"), "fuzz", "fuzz b"), "full", "full c");
        assert_eq!(text, format!("{HEAD}full c\nfuzz b\n"));
    }

    #[test]
    fn a_full_run_that_is_old_or_unknown_is_refused() {
        let passes = |age| matches!(verdict(age), Outcome::Passed);
        assert!(passes(Some(0)) && passes(Some(OLDEST)));
        assert!(!passes(Some(OLDEST + 1)) && !passes(None));
    }

    #[test]
    fn a_file_that_the_tests_left_is_seen() {
        assert!(matches!(unchanged(Some(" M a"), Some(" M a")), Outcome::Passed));
        assert!(!matches!(unchanged(Some(""), Some("?? b")), Outcome::Passed));
    }
}
