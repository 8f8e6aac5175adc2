//! Writes a record from a recorder's blocks.

use std::io::{self, Write};

use specgen_runtime::record::{write_block, write_header};
use specgen_runtime::recorder::Recorder;

/// Writes a record to a file.
pub struct Writer<W> {
    sink: W,
}

impl<W: Write> Writer<W> {
    /// Starts the record of the controller with the self-description `description`.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn new(mut sink: W, description: &str) -> io::Result<Self> {
        write_header(description, |piece| sink.write_all(piece))?;
        Ok(Self { sink })
    }

    /// Writes a closed block.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn take(&mut self, block: &[u64]) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(block.len() * 8 + 8);
        // Into memory, which cannot fail: a file then needs a single write.
        let Ok(()) = write_block(block, |piece| {
            bytes.extend_from_slice(piece);
            Ok::<(), std::convert::Infallible>(())
        });
        self.sink.write_all(&bytes)
    }

    /// Writes all closed blocks of a recorder, and releases them.
    ///
    /// # Errors
    /// As [`Writer::take`]; blocks that were written are released.
    pub fn drain(&mut self, recorder: &mut Recorder<'_>) -> io::Result<()> {
        while let Some(block) = recorder.block(0) {
            self.take(block)?;
            recorder.release();
        }
        Ok(())
    }

    /// The sink, flushed.
    ///
    /// # Errors
    /// It cannot be flushed.
    pub fn finish(mut self) -> io::Result<W> {
        self.sink.flush()?;
        Ok(self.sink)
    }
}
