//! The learned correction as a table of knots, and its file with spec, machine and motion.

use std::path::Path;

use serde::{Deserialize, Serialize};
use specgen_language::files;
use specgen_runtime::playback::{Knot, UNIT};

/// Format and version of the file.
const FORMAT: &str = "specgen correction 1";

/// A learned correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Format and version.
    format: String,
    /// Digest of the spec.
    pub digest: String,
    /// The user's name of the machine on which it was learned.
    pub machine: String,
    /// The user's name of the motion.
    pub motion: String,
    /// Ticks between knots.
    pub spacing: u32,
    /// Ticks of rest before the motion.
    pub before: u32,
    /// Start pose of the motion, in the user's coordinates, m and rad.
    pub start: [f64; 6],
    /// Knots, pm and prad.
    pub knots: Vec<Knot>,
}

/// Why a file is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read.
    #[error("{0}")]
    Unread(String),
    /// Not a correction file.
    #[error("not a correction written by `specgen learn`: {0}")]
    Format(String),
    /// It is for another spec, machine or motion: kind, value in the file, current value.
    #[error("it was learned for the {0} `{1}`, not `{2}`; learn again without --from")]
    Other(&'static str, String, String),
    /// Not a response file.
    #[error("not a response written by `specgen learn --excite`: {0}")]
    Response(String),
    /// The response of another spec or machine: kind, value in the file, current value.
    #[error("it was measured with the {0} `{1}`, not `{2}`; measure it again with --excite")]
    Measured(&'static str, String, String),
}

impl Table {
    /// A table for the digest of a spec, a machine and a named motion from this start pose; `spacing` and `before` in ticks.
    pub fn new(
        [digest, machine, motion]: [&str; 3],
        [spacing, before]: [u32; 2],
        start: [f64; 6],
        knots: Vec<Knot>,
    ) -> Self {
        let [digest, machine, motion] = [digest, machine, motion].map(str::to_owned);
        Self { format: FORMAT.to_owned(), digest, machine, motion, spacing, before, start, knots }
    }

    /// The file content: JSON, one knot per line.
    pub fn to_json(&self) -> String {
        let head = serde_json::json!({
            "format": self.format, "digest": self.digest, "machine": self.machine, "motion": self.motion,
            "spacing": self.spacing, "before": self.before, "start": self.start,
        });
        let lines: Vec<String> = self.knots.iter().map(|knot| format!("{knot:?}")).collect();
        let head = head.to_string();
        format!("{},\n\"knots\":[\n{}\n]}}\n", head.trim_end_matches('}'), lines.join(",\n"))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read or is not a correction.
    pub fn of_file(path: &Path) -> Result<Self, TableError> {
        Self::read(&files::text(path).map_err(|unread| TableError::Unread(format!("cannot be read: {unread}")))?)
    }

    /// Parses the text of a file.
    ///
    /// # Errors
    /// If it is not a correction.
    pub fn read(text: &str) -> Result<Self, TableError> {
        let table: Self = serde_json::from_str(text).map_err(|error| TableError::Format(error.to_string()))?;
        if table.format != FORMAT {
            return Err(TableError::Format(format!("the format is `{}`, expected `{FORMAT}`", table.format)));
        }
        if table.spacing == 0 {
            return Err(TableError::Format("`spacing` is 0; it must be at least 1 tick".to_owned()));
        }
        if !table.start.iter().all(|place| place.is_finite()) {
            return Err(TableError::Format("`start` is not a pose".to_owned()));
        }
        Ok(table)
    }

    /// Checks that it is for this spec, machine and motion.
    ///
    /// # Errors
    /// If it is for another.
    pub fn is_for(&self, digest: &str, machine: &str, motion: &str) -> Result<(), TableError> {
        let parts = [
            ("spec with digest", &self.digest, digest),
            ("machine", &self.machine, machine),
            ("motion", &self.motion, motion),
        ];
        same(&parts, TableError::Other)
    }
}

/// Compares what a file names with what is used: name, text in the file, text of the user.
pub(super) fn same(
    parts: &[(&'static str, &String, &str)],
    error: fn(&'static str, String, String) -> TableError,
) -> Result<(), TableError> {
    match parts.iter().find(|(_, there, here)| there.as_str() != *here) {
        Some((what, there, here)) => Err(error(what, (*there).clone(), (*here).to_owned())),
        None => Ok(()),
    }
}

/// Knots of the spline through every `spacing`-th value of a signal (m and rad) that starts and ends at 0.
pub fn knots(signal: &[[f64; 6]], spacing: u32) -> Vec<Knot> {
    let values: Vec<[f64; 6]> = signal.iter().step_by(spacing as usize).copied().collect();
    let size = values.len();
    let mut knots = vec![[0; 6]; size];
    let mut eliminated = vec![[0.0; 2]; size];
    for axis in 0..6 {
        // (a_{k−1} + 4 a_k + a_{k+1})/6 = v_k.
        let mut last = [0.0; 2];
        for (kept, value) in eliminated.iter_mut().zip(&values) {
            let pivot = 4.0 - last[0];
            last = [1.0 / pivot, (6.0 * value[axis] / UNIT - last[1]) / pivot];
            *kept = last;
        }
        let mut next = 0.0;
        for (knot, [above, value]) in knots.iter_mut().zip(&eliminated).rev() {
            next = value - above * next;
            // A value beyond the word's range is beyond every limit; the cast saturates.
            knot[axis] = libm::round(next) as i32;
        }
    }
    knots
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_runtime::playback;

    #[test]
    fn the_spline_interpolates_the_signal() {
        let signal: Vec<[f64; 6]> = (0..1001)
            .map(|tick| {
                let t = f64::from(tick) / 1000.0;
                let window = libm::pow(libm::sin(std::f64::consts::PI * t), 2.0);
                std::array::from_fn(|axis| 1e-6 * window * libm::sin(40.0 * t + axis as f64))
            })
            .collect();
        let knots = knots(&signal, 5);
        for (tick, wanted) in signal.iter().enumerate() {
            let found: [f64; 6] = playback::at(&knots, 5, tick as u32);
            let allowed = if tick % 5 == 0 { 1.5e-12 } else { 3e-11 };
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found - wanted).abs() < allowed, "{tick}: {found:e} {wanted:e}");
            }
        }
        assert_eq!(playback::at::<f64>(&knots, 5, 2000), [0.0; 6]);
    }

    #[test]
    fn a_table_is_read_back_and_refused_for_another_use() {
        let knots = vec![[1, -2, 3, 4, 5, i32::MIN]; 3];
        let table = Table::new(["d1", "stage 7", "case-1 10 Hz"], [5, 7], [0.1; 6], knots);
        let back = Table::read(&table.to_json()).unwrap();
        assert_eq!(back, table);
        assert_eq!(back.is_for("d1", "stage 7", "case-1 10 Hz"), Ok(()));
        for (digest, machine, motion) in
            [("d2", "stage 7", "case-1 10 Hz"), ("d1", "stage 8", "case-1 10 Hz"), ("d1", "stage 7", "x")]
        {
            let error = back.is_for(digest, machine, motion).unwrap_err().to_string();
            assert!(error.contains("learn again"), "{error}");
        }
        for text in ["", "{}", &table.to_json().replace("correction 1", "correction 9")] {
            assert!(Table::read(text).is_err(), "{text}");
        }
    }
}
