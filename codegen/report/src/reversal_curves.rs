//! Writes and plots records of reversal curves.

use std::fs;
use std::path::{Path, PathBuf};

use host_sim::forc::ReversalRecord;
use serde::Serialize;
use specgen_language::arrays::Form;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{unwritten, write_table};

use crate::chart::{Axis, Chart, LINE};
use crate::drawing::Plot;

/// Suffixes of the files of the fast set and of the arbitrary record.
const FURTHER: [&str; 2] = ["fast", "arbitrary"];

/// A written record of reversal curves.
#[derive(Serialize)]
pub struct Curves {
    rows: usize,
    file: String,
    /// The fast set and the arbitrary record.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    further: Vec<Curves>,
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
        let further: String = self.further.iter().map(Outcome::text).collect();
        format!("wrote {} rows to {}\n{further}{plot}", self.rows, self.file)
    }
}

impl Curves {
    /// Writes records: the first to `output`, further ones beside it. Plots the first.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn of(records: &[ReversalRecord], output: &Path, plot: &Plot) -> Result<Self, Failure> {
        let texts: Vec<String> = records.iter().map(ReversalRecord::to_csv).collect();
        let charts: Vec<Chart> = records.iter().take(1).map(chart).collect();
        // Two lines that are not rows: names and mark.
        let written = Self::write(&texts, 2, output)?;
        Ok(Self { plot: plot.charts("reversal curves", "displacement over drive", &charts)?, ..written })
    }

    /// Writes drive signals for a generator, as [`Curves::of`]; each text starts with a header line.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn of_drives(texts: &[String], output: &Path) -> Result<Self, Failure> {
        Self::write(texts, 1, output)
    }

    fn write(texts: &[String], heads: usize, output: &Path) -> Result<Self, Failure> {
        let paths = [output.to_owned()].into_iter().chain(FURTHER.map(|suffix| beside(output, suffix)));
        // The user did not name the further ones.
        for (text, path) in texts.iter().zip(paths.clone()).skip(1) {
            let head = |text: &str| text.lines().take(heads).map(str::to_owned).collect::<Vec<_>>();
            let is_own = || fs::read_to_string(&path).is_ok_and(|old| head(&old) == head(text));
            // Arrays are not compared: any that is there stays.
            let is_other = path.exists() && (Form::of(&path).is_some() || !is_own());
            if is_other {
                let why = "another file has that name; move it, or name another output";
                return Err(unwritten(&path, &why));
            }
        }
        let mut written = Vec::new();
        for (text, path) in texts.iter().zip(paths) {
            write_table(&path, text.as_bytes())?;
            let rows = text.lines().count() - heads;
            written.push(Self { rows, file: path.display().to_string(), further: Vec::new(), plot: None });
        }
        let further = written.split_off(1);
        Ok(Self { further, ..written.remove(0) })
    }
}

/// `leg.csv` to `leg-fast.csv`.
fn beside(output: &Path, suffix: &str) -> PathBuf {
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let mut name = format!("{}-{suffix}", part(output.file_stem()));
    if output.extension().is_some() {
        name += &format!(".{}", part(output.extension()));
    }
    output.with_file_name(name)
}
