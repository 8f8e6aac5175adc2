//! The part of a path that a result covers.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The duration of a measurement, and the length of its path. Every tracking result has one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Coverage {
    /// Duration of the measurement, a whole number of ticks, s.
    pub seconds: f64,
    /// Length of the path in whole ticks, s; for a repeated path, of one repetition. Longer than `seconds` if only a
    /// part was requested.
    pub path_seconds: f64,
}

impl Coverage {
    /// For a number of ticks of an interval (s), of a path of `path` ticks.
    pub fn new(ticks: usize, path: usize, interval: f64) -> Self {
        Self { seconds: ticks as f64 * interval, path_seconds: path as f64 * interval }
    }

    /// `1.000/1.000 s`, a short form: duration, and length of the path.
    pub fn brief(&self) -> String {
        format!("{:.3}/{:.3} s", self.seconds, self.path_seconds)
    }

    /// Whether the path was measured completely, at least once.
    pub fn is_whole(&self) -> bool {
        self.seconds >= self.path_seconds
    }
}

/// `1.000 s, the whole path`, `0.500 s of a path of 1.000 s`, or `60.000 s, a path of 0.500 s repeated`.
impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, path_seconds } = self;
        if !self.is_whole() {
            write!(f, "{seconds:.3} s of a path of {path_seconds:.3} s")
        } else if seconds > path_seconds {
            write!(f, "{seconds:.3} s, a path of {path_seconds:.3} s repeated")
        } else {
            write!(f, "{seconds:.3} s, the whole path")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_the_whole_and_repetitions_are_told_apart() {
        // 0.1 + 0.1 + 0.1 is not 0.3: lengths are counted in ticks.
        for (ticks, path, whole, text) in [
            (3, 3, true, "0.300 s, the whole path"),
            (2, 3, false, "0.200 s of a path of 0.300 s"),
            (6, 3, true, "0.600 s, a path of 0.300 s repeated"),
        ] {
            let coverage = Coverage::new(ticks, path, 0.1);
            assert_eq!((coverage.is_whole(), &*coverage.to_string()), (whole, text));
            assert_eq!(coverage.brief(), format!("0.{ticks}00/0.300 s"));
        }
    }
}
