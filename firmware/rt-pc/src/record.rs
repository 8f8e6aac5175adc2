//! The record of a whole run: rows from the ring, in the format of recorders, block by block into a file.
//!
//! The blocks are made here, so that the loop only adds a state now and then. Skipped ticks have no row; the next tick
//! has the event. Lost rows are a gap, after which the record continues with a state.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use controller::snapshot::RECORD_LAYOUT;
use controller::snapshot::recorder::{Recorder, Settings};
use controller::{CONFIG_WORDS, Config, DESCRIPTION};
use rtrb::Consumer;
use specgen_runtime::record::{write_block, write_header};

use crate::handover::{Row, SNAPSHOT_EVERY, Snapshot};
use crate::outputs;

/// One block that is filled, and one that is written.
const BLOCKS: usize = 2;
/// Words of a block: its rows always fit.
const BLOCK: usize = RECORD_LAYOUT.preamble() + SNAPSHOT_EVERY as usize * RECORD_LAYOUT.longest_row();

/// Writes the start of a record of this controller.
///
/// # Errors
/// If it cannot be written.
pub fn begin(out: &mut impl Write) -> io::Result<()> {
    write_header(DESCRIPTION, |piece| out.write_all(piece))
}

/// Writes a block.
///
/// # Errors
/// If it cannot be written.
pub fn add(out: &mut impl Write, block: &[u64]) -> io::Result<()> {
    write_block(block, |piece| out.write_all(piece))
}

/// A recorder with memory for the life of the program, so that it can be passed between threads.
///
/// # Errors
/// As text, if the memory is too small for this controller.
pub fn recorder(blocks: usize, words: usize) -> Result<Recorder<'static>, String> {
    let memory = vec![0; blocks * words].leak();
    Recorder::new(memory, blocks, RECORD_LAYOUT).map_err(|unfit| format!("no recorder for this controller: {unfit:?}"))
}

/// A record that is being written.
pub struct Writer {
    file: BufWriter<File>,
    recorder: Recorder<'static>,
    /// Settings, present or future, by the number of commands that were taken before their first tick.
    configs: VecDeque<(u32, [u64; CONFIG_WORDS])>,
    /// Settings of the open block.
    config: [u64; CONFIG_WORDS],
    rows: u64,
}

impl Writer {
    /// A new file; one of this name is replaced.
    ///
    /// # Errors
    /// As text, if it cannot be written.
    pub fn create(path: &Path, config: &Config) -> Result<Self, String> {
        let named = |error: io::Error| format!("{}: {error}", path.display());
        let mut file = BufWriter::with_capacity(1 << 16, outputs::create(path).map_err(named)?);
        // At once, so that a full disk is noticed before anything moves.
        begin(&mut file).and_then(|()| file.flush()).map_err(named)?;
        let mut recorder = recorder(BLOCKS, BLOCK)?;
        recorder.start(Settings::STREAM);
        Ok(Self { file, recorder, configs: VecDeque::new(), config: config.to_words(), rows: 0 })
    }

    /// Command number `order` changes the settings.
    pub fn configured(&mut self, order: u32, config: &Config) {
        self.configs.push_back((order, config.to_words()));
    }

    /// Adds a tick.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add(&mut self, row: &Row, snapshots: &mut Consumer<Snapshot>) -> io::Result<()> {
        if row.opens {
            let Some(snapshot) = snapshots.pop().ok().filter(|snapshot| snapshot.count == row.count) else {
                return Err(io::Error::other("a block came without its state: report this as a defect of specgen"));
            };
            let mut changed = false;
            // Order numbers wrap around.
            let taken = |order: u32| (row.commands.wrapping_sub(order) as i32) >= 0;
            while let Some((_, config)) = self.configs.front().filter(|(order, _)| taken(*order)) {
                (self.config, changed) = (*config, true);
                self.configs.pop_front();
            }
            if changed {
                self.recorder.settings_changed();
            }
            self.recorder.begin(row.count);
            self.recorder.open(&self.config, snapshot.digest, |words| words.copy_from_slice(&snapshot.state));
            self.drain()?;
        }
        self.recorder.push(&row.input.to_words(), &row.output, || row.digest);
        self.rows += 1;
        Ok(())
    }

    fn drain(&mut self) -> io::Result<()> {
        while let Some(block) = self.recorder.block(0) {
            add(&mut self.file, block)?;
            self.recorder.release();
        }
        Ok(())
    }

    /// Writes the remainder; returns the number of ticks.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> io::Result<u64> {
        self.recorder.stop();
        self.drain()?;
        self.file.flush()?;
        // A pipe or a device cannot be synchronised, and need not be.
        match self.file.get_ref().sync_all() {
            Err(error) if error.kind() != io::ErrorKind::InvalidInput => Err(error),
            _ => Ok(self.rows),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::snapshot::MACHINE_STATE_WORDS;
    use controller::supervised::{MACHINE_INPUT_WORDS, MachineInput};
    use rtrb::RingBuffer;

    #[test]
    fn a_block_has_room_for_rows_in_which_every_word_is_another_one() {
        let path = std::env::temp_dir().join(format!("rt-pc-longest-{}", std::process::id()));
        let mut writer = Writer::create(&path, &Config::new()).unwrap();
        let (mut states, mut snapshots) = RingBuffer::new(2);
        for block in 0..2 {
            let count = block * u64::from(SNAPSHOT_EVERY);
            states.push(Snapshot { count, digest: 1, state: [0; MACHINE_STATE_WORDS] }).unwrap();
            for tick in count..count + u64::from(SNAPSHOT_EVERY) {
                let words = [(tick % 5 + 1) | 1 << 40; MACHINE_INPUT_WORDS];
                let input = MachineInput::from_words(&words);
                writer.add(&Row { opens: tick == count, input, ..crate::bench::row(tick) }, &mut snapshots).unwrap();
            }
        }
        assert_eq!(writer.finish().unwrap(), 2 * u64::from(SNAPSHOT_EVERY));
        let blocks = crate::bench::blocks(&std::fs::read(&path).unwrap());
        std::fs::remove_file(&path).unwrap();
        assert_eq!(blocks.iter().map(|block| block[2]).collect::<Vec<_>>(), [u64::from(SNAPSHOT_EVERY); 2]);
        // No more memory than that takes.
        assert!(
            blocks.iter().all(|block| block[1] <= BLOCK as u64 && block[1] > BLOCK as u64 / 2),
            "{blocks:?} {BLOCK}"
        );
    }

    #[test]
    fn a_device_need_not_be_synchronised_and_a_full_one_is_known_at_once() {
        let null = Writer::create(Path::new("/dev/null"), &Config::new()).unwrap();
        assert_eq!(null.finish().unwrap(), 0);
        let full = Writer::create(Path::new("/dev/full"), &Config::new()).err().unwrap();
        assert!(full.starts_with("/dev/full: "), "{full}");
    }
}
