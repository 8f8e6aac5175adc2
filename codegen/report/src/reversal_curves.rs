//! Writes and plots records of reversal curves.

use std::path::Path;

use host_sim::forc::ReversalRecord;
use serde::Serialize;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;

use crate::chart::{Axis, Chart, LINE};
use crate::drawing::Plot;

/// A written record of reversal curves.
#[derive(Serialize)]
pub struct Curves {
    rows: usize,
    file: String,
    /// The line about the plot.
    #[serde(skip)]
    plot: Option<String>,
}

/// Chart of the loops of a record.
fn chart(record: &ReversalRecord) -> Chart {
    let points = record.rows.iter().map(|row| [row.drive, row.displacement * 1e6]).collect();
    Chart::new("", "hysteresis", Axis::linear("drive", "V"), Axis::linear("displacement", "µm")).with("", LINE, points)
}

impl Outcome for Curves {
    fn text(&self) -> String {
        let plot = self.plot.as_deref().unwrap_or_default();
        format!("wrote {} rows to {}\n{plot}", self.rows, self.file)
    }
}

impl Curves {
    /// Writes and plots a record.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn of(record: &ReversalRecord, output: &Path, plot: &Plot) -> Result<Self, Failure> {
        write_file(output, record.to_csv().as_bytes())?;
        let plot = plot.charts("reversal curves", "displacement over drive", &[chart(record)])?;
        Ok(Self { rows: record.rows.len(), file: output.display().to_string(), plot })
    }

    /// Writes a drive signal for a generator; the text starts with a header line.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn of_drive(text: &str, output: &Path) -> Result<Self, Failure> {
        write_file(output, text.as_bytes())?;
        Ok(Self { rows: text.lines().count() - 1, file: output.display().to_string(), plot: None })
    }
}
