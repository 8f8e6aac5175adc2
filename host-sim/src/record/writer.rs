//! Writes a record: what a recorder hands out, block by block.

use std::io::{self, Write};

use specgen_runtime::record::{write_block, write_header};
use specgen_runtime::recorder::Recorder;

/// Something that takes closed blocks.
pub trait Taker {
    /// Takes a block.
    ///
    /// # Errors
    /// It cannot be kept.
    fn take(&mut self, block: &[u64]) -> io::Result<()>;

    /// Takes all closed blocks of a recorder, and releases them.
    ///
    /// # Errors
    /// As [`Taker::take`]; what was taken is released.
    fn drain(&mut self, recorder: &mut Recorder<'_>) -> io::Result<()> {
        while let Some(block) = recorder.block(0) {
            self.take(block)?;
            recorder.release();
        }
        Ok(())
    }
}

/// A record on its way into a file.
pub struct Writer<W> {
    sink: W,
}

impl<W: Write> Writer<W> {
    /// Begins the record of the controller that says `description` of itself.
    ///
    /// # Errors
    /// The sink does not take it.
    pub fn new(mut sink: W, description: &str) -> io::Result<Self> {
        write_header(description, |piece| sink.write_all(piece))?;
        Ok(Self { sink })
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

impl<W: Write> Taker for Writer<W> {
    fn take(&mut self, block: &[u64]) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(block.len() * 8 + 8);
        // Into memory, which takes everything: a sink that is a file is asked once.
        let Ok(()) = write_block(block, |piece| {
            bytes.extend_from_slice(piece);
            Ok::<(), std::convert::Infallible>(())
        });
        self.sink.write_all(&bytes)
    }
}
