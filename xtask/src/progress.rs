//! Progress and remaining time of a list of jobs, from their durations in the last run.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::run::clock;

/// Durations of jobs, from the last run on this machine, or from the table below.
pub struct Durations(BTreeMap<String, f64>);

/// Durations of the longest jobs, s: for the order of jobs on a machine without an earlier run.
const TABLE: &[(&str, f64)] = &[
    ("cli all::rt_pc", 85.0),
    ("tests all::supervisor", 65.0),
    ("cli all::optional", 40.0),
    ("cli all::operate", 37.0),
    ("cli all::cli", 35.0),
    ("cli all::pil", 34.0),
    ("cli all::examples", 30.0),
    ("cli all::refit", 28.0),
    ("cli all::files", 24.0),
    ("cli all::output_folder", 24.0),
    ("cli all::guide", 23.0),
    ("cli all::robust", 23.0),
    ("tests all::platform_tables", 22.0),
    ("cli all::tune", 15.0),
    ("tests all::spec_errors", 15.0),
    ("cli all::assumed", 14.0),
    ("tests all::physical_lint", 14.0),
    ("tests all::sensing", 14.0),
    ("cli all::interrupt", 11.0),
    ("cli all::kills", 11.0),
    ("cli all::microcontroller", 11.0),
    ("tests all::platform_bits", 11.0),
    ("tests all::spec_slips", 11.0),
];
/// The same for the full run.
const FULL: &[(&str, f64)] = &[
    ("tests all::platform_tables", 1300.0),
    ("tests all::identify_leg_models", 680.0),
    ("cli all::rt_pc", 610.0),
    ("tests all::run_time", 500.0),
    ("compiler all::golden", 340.0),
    ("tests all::physical_lint", 330.0),
    ("tests all::platform_bits", 330.0),
    ("tests all::supervisor", 320.0),
    ("cli all::refit", 260.0),
    ("tests all::boards", 250.0),
];
/// Duration of other jobs, s.
const OTHERS: f64 = 1.0;

impl Durations {
    /// Durations of the last run, or those of a table.
    pub fn read(path: &Path, full: bool) -> Self {
        let last = std::fs::read(path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let table = if full { FULL } else { TABLE };
        Self(last.unwrap_or_else(|| table.iter().map(|(name, seconds)| ((*name).to_owned(), *seconds)).collect()))
    }

    pub fn of(jobs: impl Iterator<Item = (String, Duration)>) -> Self {
        Self(jobs.map(|(name, took)| (name, took.as_secs_f64())).collect())
    }

    /// Writes durations for the next run. Errors are ignored: they only make its order worse.
    pub fn write(&self, path: &Path) {
        if let Ok(text) = serde_json::to_string_pretty(&self.0) {
            let _ = std::fs::write(path, text);
        }
    }

    pub fn expect(&self, name: &str) -> Duration {
        Duration::from_secs_f64(self.0.get(name).copied().filter(|s| *s >= 0.0 && *s < 1e6).unwrap_or(OTHERS))
    }
}

/// Completed and open jobs.
pub struct Progress {
    start: Instant,
    workers: usize,
    /// Expected duration of each job; none once it has ended.
    open: Vec<Option<Duration>>,
    /// Total expected and measured duration of completed jobs.
    ended: (Duration, Duration),
}

impl Progress {
    pub fn new(expected: Vec<Duration>, workers: usize) -> Self {
        let open = expected.into_iter().map(Some).collect();
        Self { start: Instant::now(), workers, open, ended: (Duration::ZERO, Duration::ZERO) }
    }

    /// `[ 12/115]  1:40, about 4:10 left`
    pub fn ended(&mut self, index: usize, took: Duration) -> String {
        if let Some(expected) = self.open.get_mut(index).and_then(Option::take) {
            self.ended.0 += expected;
            self.ended.1 += took;
        }
        let total = self.open.len();
        let left = self.open.iter().flatten().count();
        let gone = clock(self.start.elapsed());
        format!("[{:4}/{total}] {gone}, about {} left", total - left, clock(self.left()))
    }

    /// Expected time of the open jobs, scaled by the error of the expectation so far.
    fn left(&self) -> Duration {
        let expected: Duration = self.open.iter().flatten().sum();
        let ratio = if self.ended.0.is_zero() { 1.0 } else { self.ended.1.as_secs_f64() / self.ended.0.as_secs_f64() };
        expected.mul_f64(ratio.clamp(0.1, 100.0) / self.workers.max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_follows_what_was_measured() {
        let second = Duration::from_secs;
        let mut progress = Progress::new(vec![second(10), second(20), second(30)], 2);
        assert_eq!(progress.left(), second(30));
        assert!(progress.ended(0, second(20)).starts_with("[   1/3]  0:00, about  0:50 left"));
        // A job that ends twice counts once.
        progress.ended(0, second(20));
        assert_eq!(progress.left(), second(50));
        progress.ended(1, second(40));
        assert!(progress.ended(2, second(60)).ends_with("about  0:00 left"));
    }

    #[test]
    fn last_durations_come_before_the_table_and_damage_is_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("durations.json");
        Durations::of([("a".to_owned(), Duration::from_secs(7))].into_iter()).write(&path);
        assert_eq!(Durations::read(&path, false).expect("a"), Duration::from_secs(7));
        assert_eq!(Durations::read(&path, false).expect("b"), Duration::from_secs(1));
        std::fs::write(&path, "{\"a\": -1.0}").unwrap();
        assert_eq!(Durations::read(&path, false).expect("a"), Duration::from_secs(1));
        std::fs::write(&path, "no").unwrap();
        assert_eq!(Durations::read(&path, false).expect("a"), Duration::from_secs(1));
    }
}
