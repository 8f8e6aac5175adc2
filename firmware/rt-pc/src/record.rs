//! The record of a run: every word that went in and came out, streamed to a file that the host replays.
//!
//! The format is that of traces (`SPGTRACE`, see host-sim): a description, the number of rows, rows of input words, output
//! words and the digest of the machine. Ticks that were skipped have no row; the tick after them carries the event.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use controller::DESCRIPTION;
use controller::supervised::{MACHINE_INPUT_NAMES, MACHINE_OUTPUT_NAMES};

use crate::control::Row;

/// A record that is being written. Without [`Recorder::finish`] its number of rows is 0.
pub struct Recorder {
    file: BufWriter<File>,
    /// Where the number of rows stands.
    count_at: u64,
    rows: u64,
}

impl Recorder {
    /// A new file; one of this name is replaced.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        let description = description();
        file.write_all(b"SPGTRACE")?;
        file.write_all(&1_u32.to_le_bytes())?;
        file.write_all(&(description.len() as u32).to_le_bytes())?;
        file.write_all(description.as_bytes())?;
        file.write_all(&0_u64.to_le_bytes())?;
        Ok(Self { file, count_at: 16 + description.len() as u64, rows: 0 })
    }

    /// Adds a tick.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add(&mut self, row: &Row) -> io::Result<()> {
        for word in row.input.iter().chain(&row.output).chain([&row.digest]) {
            self.file.write_all(&word.to_le_bytes())?;
        }
        self.rows += 1;
        Ok(())
    }

    /// Writes what is left and the number of rows; returns it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> io::Result<u64> {
        self.file.flush()?;
        let file = self.file.get_mut();
        file.seek(SeekFrom::Start(self.count_at))?;
        file.write_all(&self.rows.to_le_bytes())?;
        file.sync_all()?;
        Ok(self.rows)
    }
}

/// The controller's description with the words of the supervised tick, padded to a multiple of eight bytes.
fn description() -> String {
    let mut text = String::new();
    for line in DESCRIPTION.lines() {
        match line.split_once('=') {
            Some(("input_names", _)) => text += &format!("input_names={}", MACHINE_INPUT_NAMES.join(",")),
            Some(("output_names", _)) => text += &format!("output_names={}", MACHINE_OUTPUT_NAMES.join(",")),
            _ => text += line,
        }
        text.push('\n');
    }
    while !text.len().is_multiple_of(8) {
        text.push('\n');
    }
    text
}
