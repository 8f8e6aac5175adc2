//! What the last soak showed, as a file of the repository.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::binaries::Ran;
use crate::run::Outcome;

/// Where it is kept.
const FILE: &str = "tests/soak.txt";

/// Writes when it was, of what, how long it took, and a digest of every test with its result. One that failed is not kept.
pub fn write(root: &Path, ran: &Ran, took: Duration, good: bool) -> Outcome {
    if !good {
        return Outcome::Skipped(format!("a soak that failed is not kept in {FILE}"));
    }
    let git = |arguments: &[&str]| {
        let output = Command::new("git").current_dir(root).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_none_or(|text| !text.is_empty());
    let today = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let text = text(ran, took, &commit, changed, &date(today));
    print!("{text}");
    match std::fs::write(root.join(FILE), text) {
        Ok(()) => Outcome::Passed,
        Err(error) => Outcome::Failed(format!("{FILE}: {error}")),
    }
}

fn text(ran: &Ran, took: Duration, commit: &str, changed: bool, date: &str) -> String {
    let mut results = String::new();
    for (name, passed) in &ran.tests {
        // Writing to a String cannot fail.
        let _ = writeln!(results, "{} {name}", if *passed { "ok" } else { "failed" });
    }
    for (job, why) in &ran.skipped {
        let _ = writeln!(results, "skipped {job}: {why}");
    }
    format!(
        "Written by `cargo xtask soak`: every test at full length, before a release.\n\n\
         date      {date}\ncommit    {commit}{}\ntests     {}\nskipped   {}\nminutes   {:.0}\nresults   sha256 {}\n",
        if changed { ", with changes" } else { "" },
        ran.tests.len(),
        ran.skipped.len(),
        took.as_secs_f64() / 60.0,
        specgen_toolchain::sha256(results.as_bytes()),
    )
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
        let ran = |passed| Ran { tests: vec![("tests a".to_owned(), passed)], skipped: Vec::new() };
        let of = |passed| text(&ran(passed), Duration::from_secs(60), "c", false, "d");
        assert_ne!(of(true), of(false));
        assert!(of(true).contains("minutes   1\n"));
    }
}
