//! Skipped tests and parts of tests: they are shown and counted. Under CI they must be on a list.

use std::path::Path;

use crate::run::Outcome;

/// Prefix of a test's message, before a number, its name and the reason.
const MARK: &str = "skipped ";
/// The list: a prefix of a reason per line; `#` starts a comment.
const LIST: &str = "tests/skips.txt";

/// The reasons in the output of a job.
pub fn of(text: &str) -> Vec<String> {
    let reason = |line: &str| {
        let (number, message) = line.split_once(MARK)?.1.split_once(": ")?;
        number.parse::<u32>().ok()?;
        Some(message.split_once(": ")?.1.trim().to_owned())
    };
    let mut reasons: Vec<String> = text.lines().filter_map(reason).collect();
    reasons.dedup();
    reasons
}

/// Prints them. Under CI, where nobody reads the output, an unexpected one is a failure.
pub fn judge(root: &Path, skipped: &[(String, String)]) -> Outcome {
    println!("\nskipped, completely or in part:");
    for (job, reason) in skipped {
        println!("  {job}: {reason}");
    }
    let list = std::fs::read_to_string(root.join(LIST)).unwrap_or_default();
    let unexpected: Vec<&str> =
        skipped.iter().filter(|(_, reason)| !is_listed(&list, reason)).map(|(job, _)| job.as_str()).collect();
    if unexpected.is_empty() || std::env::var_os("CI").is_none() {
        return Outcome::Passed;
    }
    Outcome::Failed(format!("skipped, and not on the list of {LIST}: {}", unexpected.join(", ")))
}

fn is_listed(list: &str, reason: &str) -> bool {
    let lines = list.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.into_iter().any(|line| reason.starts_with(line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_is_found_anywhere_and_listed_by_its_prefix() {
        let text = "test a ... ok\ntest b ... skipped 1: a::b: no card here\nskipped 2: c: QEMU is missing\nskipped 3: d: QEMU is missing\n\
                    skipped until: now\n";
        assert_eq!(of(text), ["no card here", "QEMU is missing"]);
        let list = "# devices\nno card\n\n";
        assert!(is_listed(list, "no card here"));
        assert!(!is_listed(list, "QEMU is missing"));
        assert!(!is_listed("", "anything"));
    }
}
