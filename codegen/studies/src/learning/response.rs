//! Measured response of a running loop to a correction: its file and its uncertainty.

use std::path::Path;

use serde::{Deserialize, Serialize};
use specgen_language::files;
use specgen_numerics::nyquist::square;

use super::table::{TableError, same};
use specgen_numerics::complex6::{Matrix6c, inverse, multiply, spectral_radius};

/// Format and version of the file.
const FORMAT: &str = "specgen response 1";
/// Assumed uncertainty of every entry, in standard errors.
const ERRORS: f64 = 3.0;

/// T at one frequency.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bin {
    /// Hz.
    pub hertz: f64,
    /// Response of the gauges to corrections, in modal coordinates: rows are outputs, columns inputs; real and imaginary part.
    pub response: Matrix6c,
    /// Standard error of the magnitude of each entry.
    pub error: [[f64; 6]; 6],
}

/// T of a machine, measured in closed loop while running, in the modal coordinates of its spec.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// Format and version.
    format: String,
    /// Digest of the spec.
    pub digest: String,
    /// The user's name of the machine.
    pub machine: String,
    /// In ascending order of frequency, at least two.
    pub bins: Vec<Bin>,
}

impl Response {
    /// For the digest of a spec and a machine.
    pub fn new([digest, machine]: [&str; 2], bins: Vec<Bin>) -> Self {
        let [digest, machine] = [digest, machine].map(str::to_owned);
        Self { format: FORMAT.to_owned(), digest, machine, bins }
    }

    /// The file content: JSON, one frequency per line.
    pub fn to_json(&self) -> String {
        let head =
            serde_json::json!({ "format": self.format, "digest": self.digest, "machine": self.machine }).to_string();
        let lines: Vec<String> = self.bins.iter().map(|bin| serde_json::json!(bin).to_string()).collect();
        format!("{},\n\"bins\":[\n{}\n]}}\n", head.trim_end_matches('}'), lines.join(",\n"))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read or is not a response.
    pub fn of_file(path: &Path) -> Result<Self, TableError> {
        Self::read(&files::text(path).map_err(|unread| TableError::Unread(format!("cannot be read: {unread}")))?)
    }

    /// Parses the text of a file.
    ///
    /// # Errors
    /// If it is not a response.
    pub fn read(text: &str) -> Result<Self, TableError> {
        let response: Self = serde_json::from_str(text).map_err(|error| TableError::Response(error.to_string()))?;
        if response.format != FORMAT {
            return Err(TableError::Response(format!("the format is `{}`, expected `{FORMAT}`", response.format)));
        }
        let bins = &response.bins;
        if bins.len() < 2 || !(bins[0].hertz > 0.0 && bins.windows(2).all(|pair| pair[0].hertz < pair[1].hertz)) {
            return Err(TableError::Response(
                "`bins` must be at least two, in ascending order of frequency".to_owned(),
            ));
        }
        Ok(response)
    }

    /// Checks that it belongs to this spec and machine.
    ///
    /// # Errors
    /// If it belongs to another.
    pub fn is_for(&self, digest: &str, machine: &str) -> Result<(), TableError> {
        let parts = [("spec with digest", &self.digest, digest), ("machine", &self.machine, machine)];
        same(&parts, TableError::Measured)
    }

    /// T at a frequency, Hz, interpolated linearly; constant beyond the measured range.
    pub fn at(&self, hertz: f64) -> Matrix6c {
        let above = self.bins.partition_point(|bin| bin.hertz <= hertz);
        match (above.checked_sub(1).and_then(|below| self.bins.get(below)), self.bins.get(above)) {
            (Some(below), Some(above)) => {
                let part = (hertz - below.hertz) / (above.hertz - below.hertz);
                let between = |a: f64, b: f64| a + (b - a) * part;
                std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        let [a, b] = [below, above].map(|bin| bin.response[i][j]);
                        [between(a[0], b[0]), between(a[1], b[1])]
                    })
                })
            }
            (Some(one), None) | (None, Some(one)) => one.response,
            (None, None) => [[[0.0; 2]; 6]; 6],
        }
    }
}

impl Bin {
    /// Bound of ρ(I − T_real T⁻¹) for every T_real within three standard errors in every entry: that of the matrix of magnitudes.
    pub(super) fn doubt(&self) -> f64 {
        let inverse = inverse(&self.response).map(|row| row.map(|value| [libm::sqrt(square(value)), 0.0]));
        spectral_radius(&multiply(&self.error.map(|row| row.map(|error| [ERRORS * error, 0.0])), &inverse))
    }
}
