//! Runs cargo, and records steps and their results.

use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

/// Exit code of a program that was allowed to skip a step.
pub const SKIPPED: u8 = 3;

/// Result of a step.
pub enum Outcome {
    /// Passed.
    Passed,
    /// Skipped, with permission; the reason.
    Skipped(String),
    /// What went wrong and how to fix it.
    Failed(String),
}

/// Steps so far.
pub struct Report {
    start: Instant,
    /// Number of all steps.
    total: usize,
    steps: Vec<(String, Outcome, Duration)>,
}

impl Report {
    /// A report of `total` steps.
    pub fn new(total: usize) -> Self {
        Self { start: Instant::now(), total, steps: Vec::new() }
    }

    /// Runs a step and shows its output. Later steps run even if it fails.
    pub fn step(&mut self, name: &str, work: impl FnOnce() -> Outcome) {
        let start = Instant::now();
        let gone = clock(start - self.start);
        println!("\n=== {gone}  step {} of {}: {name}", self.steps.len() + 1, self.total);
        let outcome = work();
        self.steps.push((name.to_owned(), outcome, start.elapsed()));
    }

    /// Whether every step passed, and none was skipped.
    pub fn is_whole(&self) -> bool {
        self.steps.iter().all(|(_, outcome, _)| matches!(outcome, Outcome::Passed))
    }

    /// Whether a step failed.
    pub fn has_failed(&self) -> bool {
        self.steps.iter().any(|(_, outcome, _)| matches!(outcome, Outcome::Failed(_)))
    }

    /// Prints one line per step; an error code if one failed.
    #[must_use]
    pub fn finish(self) -> ExitCode {
        println!("\n=== {}  summary", clock(self.start.elapsed()));
        for (name, outcome, took) in &self.steps {
            let (word, detail) = match outcome {
                Outcome::Passed => ("ok", ""),
                Outcome::Skipped(why) => ("SKIPPED", why.as_str()),
                Outcome::Failed(why) => ("FAILED", why.as_str()),
            };
            println!("{word:8}{name:28}{:6.1} s  {detail}", took.as_secs_f64());
        }
        if self.has_failed() { ExitCode::FAILURE } else { ExitCode::SUCCESS }
    }
}

/// Minutes and seconds.
pub fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    format!("{:2}:{:02}", seconds / 60, seconds % 60)
}

/// A call of cargo in the repository, the same cargo that runs this program.
pub fn cargo(root: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root).args(arguments);
    command
}

/// Runs a command and shows its output; `fix` is advice for a failure.
pub fn expect_success(mut command: Command, fix: &str) -> Outcome {
    match command.status() {
        Ok(status) if status.success() => Outcome::Passed,
        Ok(status) => Outcome::Failed(format!("{status}; {fix}")),
        Err(error) => Outcome::Failed(format!("{}: {error}", command.get_program().display())),
    }
}
