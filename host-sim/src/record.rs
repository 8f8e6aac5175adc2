//! Records: a recorder's output as a file. The format is in [`specgen_runtime::record`].
//!
//! Files are read block by block, so that an hour fits through a small memory. Damage is reported with the lost ticks;
//! everything before and after it is still read.

mod csv;
mod recorded;
mod replay;
mod writer;

use std::io::{self, Read};

use specgen_runtime::record::{
    BLOCK_MAGIC, FILE_MAGIC, FORMAT, HAS_DIGEST, HEADER_WORDS, LARGEST_INPUT, NO_TRIGGER, OUTPUT_WORDS, Reason,
    checksum, write_header,
};

use crate::description::{Description, DescriptionError, fields};

pub use csv::{ReplayedRows, write_csv};
pub use recorded::{RecordedController, RecordingEnd};
pub use replay::{Divergence, PhaseChange, Replay, ReplayError, replay};
pub use writer::Writer;

/// Largest valid block, words: 64 MiB.
const LARGEST_BLOCK: u64 = 1 << 23;
/// Longest text at the start of a file, bytes.
const LONGEST_TEXT: u32 = 1 << 20;

/// Description in a record of the controller that made it.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Its words and its spec.
    pub description: Description,
    /// Control period, s.
    pub period: f64,
}

/// A row of a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Tick since the recorder was made.
    pub tick: u64,
    /// Input words.
    pub input: Vec<u64>,
    /// Converter codes.
    pub codes: [i32; 6],
    /// Status of the tick.
    pub status: u32,
    /// Phase, cause << 8, amplifiers on << 16.
    pub supervisor: u32,
    /// Digest of the machine after the tick, if it was computed.
    pub digest: Option<u64>,
}

/// A block of a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Tick of the first row.
    pub first: u64,
    /// Why it begins.
    pub reason: Reason,
    /// One tick in so many is a row.
    pub decimation: u32,
    /// Digest of the machine before the first row.
    pub digest: u64,
    /// Tick of the trigger, if it was in this block.
    pub trigger: Option<u64>,
    /// Settings.
    pub config: Vec<u64>,
    /// State before the first row.
    pub state: Vec<u64>,
    /// Rows in order of time.
    pub rows: Vec<Row>,
}

/// Next item of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FileItem {
    /// A block.
    Block(Block),
    /// A damaged block; the next one can be found.
    Damaged {
        /// Number of the block in the file, from 1.
        block: usize,
        /// Description of the damage.
        reason: String,
    },
    /// The file ends within a block: it was cut off.
    Cut {
        /// Bytes of that block that exist.
        bytes: usize,
    },
}

/// Reason why a file is not a record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// It does not begin as a record does.
    #[error("not a record: it does not begin with SPGRECRD; name a file that a recorder wrote")]
    NotARecord,
    /// It is of another version of the format.
    #[error("record format {0}, expected {FORMAT}; use the specgen version that the target was built with")]
    Format(u32),
    /// Its start is cut off or damaged.
    #[error("the record's beginning is damaged ({0}); fetch or copy it again")]
    Header(String),
    /// Its description is unusable.
    #[error("the record's beginning: {0}")]
    Description(DescriptionError),
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
}

/// Reads a record item by item.
pub struct Reader<R> {
    source: R,
    header: Header,
    block: usize,
    ended: bool,
}

impl<R: Read> Reader<R> {
    /// Reads the beginning.
    ///
    /// # Errors
    /// If it is not a record of this version.
    pub fn new(mut source: R) -> Result<Self, RecordError> {
        let mut start = [0; 16];
        let got = fill(&mut source, &mut start)?;
        if got < 8 || start[..8] != FILE_MAGIC {
            return Err(RecordError::NotARecord);
        }
        let cut = || RecordError::Header("it is cut off".to_owned());
        if got < 16 {
            return Err(cut());
        }
        let number = |at: usize| u32::from_le_bytes([start[at], start[at + 1], start[at + 2], start[at + 3]]);
        if number(8) != FORMAT {
            return Err(RecordError::Format(number(8)));
        }
        let length = number(12);
        if length > LONGEST_TEXT || !length.is_multiple_of(8) {
            return Err(RecordError::Header(format!("a text of {length} bytes")));
        }
        let mut bytes = vec![0; length as usize + 8];
        if fill(&mut source, &mut bytes)? < bytes.len() {
            return Err(cut());
        }
        let (text, sum) = bytes.split_at(length as usize);
        let text = str::from_utf8(text).map_err(|error| RecordError::Header(error.to_string()))?;
        let mut expected = Vec::new();
        let _ = write_header(text, |piece| {
            expected.extend_from_slice(piece);
            Ok::<(), ()>(())
        });
        if !expected.ends_with(sum) {
            return Err(RecordError::Header("its checksum differs".to_owned()));
        }
        let description = Description::parse(text).map_err(RecordError::Description)?;
        let period = fields(text).get("period").and_then(|value| value.parse().ok()).filter(|period| *period > 0.0);
        let period = period.ok_or(RecordError::Description(DescriptionError::Missing("period")))?;
        Ok(Self { source, header: Header { description, period }, block: 0, ended: false })
    }

    /// Whose record it is.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Input words of a row: those of the control law, then those of the supervisor.
    pub fn input_names(&self) -> Vec<String> {
        self.header.input_names()
    }

    /// The next item; none at the end.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn next_piece(&mut self) -> Result<Option<FileItem>, RecordError> {
        if self.ended {
            return Ok(None);
        }
        let mut start = [0; HEADER_WORDS * 8];
        let got = fill(&mut self.source, &mut start)?;
        self.block += 1;
        if got == 0 {
            self.ended = true;
            return Ok(None);
        }
        if got < start.len() {
            return Ok(Some(self.cut(got)));
        }
        let mut words = words_of(&start);
        let (magic, length) = (words[0], words[1]);
        if magic != BLOCK_MAGIC || length < HEADER_WORDS as u64 || length > LARGEST_BLOCK {
            // The start of the next one is not known either.
            self.ended = true;
            return Ok(Some(
                self.damaged("it does not begin as a block does, and what follows it cannot be found".to_owned()),
            ));
        }
        let mut rest = vec![0; (length as usize - HEADER_WORDS + 1) * 8];
        let more = fill(&mut self.source, &mut rest)?;
        if more < rest.len() {
            return Ok(Some(self.cut(got + more)));
        }
        words.extend(words_of(&rest));
        let sum = words.pop().unwrap_or_default();
        let found = checksum(&words);
        if found != sum {
            return Ok(Some(self.damaged(format!("its checksum is {found:08x}, {sum:08x} was written"))));
        }
        Ok(Some(match parse(&words, self.header.input_names().len()) {
            Ok(block) => FileItem::Block(block),
            Err(reason) => self.damaged(reason),
        }))
    }

    fn damaged(&self, reason: String) -> FileItem {
        FileItem::Damaged { block: self.block, reason }
    }

    fn cut(&mut self, bytes: usize) -> FileItem {
        self.ended = true;
        FileItem::Cut { bytes }
    }
}

impl Header {
    /// Names of a row's input words: those of the control law, then those of the supervisor.
    pub fn input_names(&self) -> Vec<String> {
        let mut names = self.description.input_names.clone();
        names.extend(["request", "events"].map(str::to_owned));
        names
    }
}

/// A block from its words, without the checksum.
fn parse(words: &[u64], inputs: usize) -> Result<Block, String> {
    let [_, _, rows, first, reason, digest, layout, trigger, body @ ..] = words else {
        return Err("it has no header".to_owned());
    };
    let (config, input, state) =
        ((layout & 0xffff) as usize, (layout >> 16 & 0xffff) as usize, (layout >> 32) as usize);
    if input != inputs || input > LARGEST_INPUT {
        return Err(format!("its rows have {input} input words, the controller {inputs}"));
    }
    let reason_word = reason & 0xffff_ffff;
    let decimation = (reason >> 32) as u32;
    let reason = Reason::from_word(reason_word).ok_or_else(|| format!("its reason {reason_word} is unknown"))?;
    if decimation == 0 {
        return Err("its decimation is 0".to_owned());
    }
    let (Some(config), Some(state), Some(mut rest)) =
        (body.get(..config), body.get(config..config + state), body.get(config + state..))
    else {
        return Err("it is shorter than its settings and its state".to_owned());
    };
    let mut last = vec![0; input];
    let mut decoded = Vec::new();
    for row in 0..*rows {
        let tick = first.saturating_add(row.saturating_mul(u64::from(decimation)));
        let row =
            take_row(&mut rest, &mut last, tick).ok_or_else(|| format!("its row of tick {tick} is incomplete"))?;
        decoded.push(row);
    }
    if !rest.is_empty() {
        return Err(format!("{} words follow its last row", rest.len()));
    }
    Ok(Block {
        first: *first,
        reason,
        decimation,
        digest: *digest,
        trigger: (*trigger != NO_TRIGGER).then_some(*trigger),
        config: config.to_vec(),
        state: state.to_vec(),
        rows: decoded,
    })
}

fn take_row(rest: &mut &[u64], last: &mut [u64], tick: u64) -> Option<Row> {
    let (which, mut words) = rest.split_first()?;
    if *which & !HAS_DIGEST >> last.len() << last.len() & !HAS_DIGEST != 0 {
        return None;
    }
    for (bit, slot) in last.iter_mut().enumerate() {
        if which >> bit & 1 == 1 {
            let (word, following) = words.split_first()?;
            *slot = *word;
            words = following;
        }
    }
    let (outputs, mut words) = words.split_first_chunk::<OUTPUT_WORDS>()?;
    let mut digest = None;
    if which & HAS_DIGEST != 0 {
        let (word, following) = words.split_first()?;
        digest = Some(*word);
        words = following;
    }
    *rest = words;
    let code = |leg: usize| (outputs[leg / 2] >> (32 * (leg % 2))) as u32 as i32;
    Some(Row {
        tick,
        input: last.to_vec(),
        codes: std::array::from_fn(code),
        status: outputs[3] as u32,
        supervisor: (outputs[3] >> 32) as u32,
        digest,
    })
}

/// Little-endian words; a remainder of fewer than eight bytes is ignored.
fn words_of(bytes: &[u8]) -> Vec<u64> {
    bytes.as_chunks().0.iter().map(|chunk| u64::from_le_bytes(*chunk)).collect()
}

/// Reads until `bytes` is full or the source ends; returns how many bytes there were.
fn fill(source: &mut impl Read, bytes: &mut [u8]) -> io::Result<usize> {
    let mut done = 0;
    while done < bytes.len() {
        match source.read(&mut bytes[done..]) {
            Ok(0) => break,
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(done)
}

#[cfg(test)]
mod tests;
