//! Exports a record to other formats, block by block while it is read.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use host_sim::record::{self, Block, Header, ReplayedRows};

use super::messages::Messages;
use specgen_language::outcome::Failure;
use specgen_language::output::{TableFile, unwritten};

/// Files being written.
#[derive(Default)]
pub struct Exports {
    csv: Option<Csv>,
    mcap: Option<Messages>,
    rows: u64,
}

impl Exports {
    pub fn new(csv: Option<&Path>, mcap: Option<&Path>) -> Result<Self, Failure> {
        Ok(Self { csv: csv.map(Csv::new).transpose()?, mcap: mcap.map(Messages::new).transpose()?, rows: 0 })
    }

    pub fn add(&mut self, header: &Header, block: &Block, again: Option<ReplayedRows>) -> Result<(), Failure> {
        if let Some(csv) = &mut self.csv {
            csv.add(header, block, again, self.rows == 0)?;
        }
        if let Some(mcap) = &mut self.mcap {
            mcap.add(header, block, again)?;
        }
        self.rows += block.rows.len() as u64;
        Ok(())
    }

    /// Renames the files to their final names; returns the number of rows.
    pub fn finish(self) -> Result<u64, Failure> {
        self.csv.map(Csv::finish).transpose()?;
        self.mcap.map(Messages::finish).transpose()?;
        Ok(self.rows)
    }
}

struct Csv {
    file: BufWriter<TableFile>,
    /// Name given by the user.
    path: PathBuf,
}

impl Csv {
    fn new(path: &Path) -> Result<Self, Failure> {
        Ok(Self { file: BufWriter::new(TableFile::create(path)?), path: path.to_owned() })
    }

    fn add(&mut self, header: &Header, block: &Block, again: Option<ReplayedRows>, first: bool) -> Result<(), Failure> {
        record::write_csv(&mut self.file, header, block, again, first).map_err(|error| unwritten(&self.path, &error))
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.file.flush().map_err(|error| unwritten(&self.path, &error))?;
        self.file.into_inner().map_err(|error| unwritten(&self.path, &error))?.keep()
    }
}
