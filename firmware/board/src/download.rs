//! The record as the bytes of its file, piece by piece: header, then blocks with their checksums. Only the blocks are
//! in memory, so a piece costs the tick no more than its copy.

use controller::DESCRIPTION;
use controller::snapshot::recorder::Recorder;
use heapless::Vec;
use specgen_runtime::Crc32;
use specgen_runtime::record::write_header;

/// Most words of a piece.
pub(crate) const WORDS: usize = 64;
/// Words that are copied at a time with the tick held off: an H7 takes a microsecond for it.
const AT_ONCE: usize = 16;
const WORD: usize = size_of::<u64>();
/// Bytes of the file before its first block: magic, format and length of the text, the text, padding, checksum.
const HEADER: usize = 16 + DESCRIPTION.len().next_multiple_of(WORD) + WORD;

/// Place of a byte in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Header,
    /// In a block: its number, its words, the byte in it.
    Block(usize, usize, usize),
    /// In the checksum after a block: its number and words, the byte in it.
    Checksum(usize, usize, usize),
    End,
}

/// Gives out pieces.
#[derive(Debug)]
pub(crate) struct Download {
    /// The checksum of the first `summed` words of this block.
    crc: Crc32,
    block: usize,
    summed: usize,
}

/// Access of the background to the recorder with the tick held off; none if it records or does not exist.
pub(crate) trait RecorderAccess: FnMut(&mut dyn FnMut(&Recorder<'static>)) -> bool {}
impl<F: FnMut(&mut dyn FnMut(&Recorder<'static>)) -> bool> RecorderAccess for F {}

impl Download {
    pub(crate) const fn new() -> Self {
        Self { crc: Crc32::new(), block: 0, summed: 0 }
    }

    /// Length of the file and its bytes from `offset` on, in `piece`: as many as fit and are of one kind. None if
    /// `look` finds no stopped recorder. Reading in order costs least, because the checksum is then available.
    pub(crate) fn read<'p>(
        &mut self,
        offset: u32,
        piece: &'p mut [u8],
        mut look: impl RecorderAccess,
    ) -> Option<(u32, &'p [u8])> {
        let offset = usize::try_from(offset).unwrap_or(usize::MAX);
        let (mut place, mut total) = (Place::End, 0);
        if !look(&mut |recorder| (place, total) = find(recorder, offset)) {
            return None;
        }
        let range = match place {
            Place::Header => header(offset, piece),
            Place::Block(block, _, byte) => {
                let mut words = Vec::new();
                copied(block, byte / WORD, &mut words, &mut look)?;
                self.sum(block, byte / WORD, &words);
                let bytes = words.iter().flat_map(|word| word.to_le_bytes());
                for (slot, value) in piece.iter_mut().zip(bytes) {
                    *slot = value;
                }
                byte % WORD..words.len() * WORD
            }
            Place::Checksum(block, length, byte) => {
                self.catch_up(block, length, &mut look)?;
                let sum = u64::from(self.crc.finish()).to_le_bytes();
                for (slot, value) in piece.iter_mut().zip(sum) {
                    *slot = value;
                }
                byte..WORD
            }
            Place::End => 0..0,
        };
        let total = u32::try_from(total).unwrap_or(u32::MAX);
        Some((total, piece.get(range).unwrap_or_default()))
    }

    /// Adds words of a block to its checksum, if they are next in order.
    fn sum(&mut self, block: usize, first: usize, words: &[u64]) {
        if first == 0 {
            (self.crc, self.block, self.summed) = (Crc32::new(), block, 0);
        }
        if self.block == block && self.summed == first {
            self.crc.words(words);
            self.summed += words.len();
        }
    }

    /// Completes the checksum of a block if its pieces were not read in order. None if it records again.
    fn catch_up(&mut self, block: usize, length: usize, look: &mut impl RecorderAccess) -> Option<()> {
        if self.block != block || self.summed > length {
            (self.crc, self.block, self.summed) = (Crc32::new(), block, 0);
        }
        while self.summed < length {
            let mut words = Vec::new();
            copied(block, self.summed, &mut words, look)?;
            if words.is_empty() {
                return None;
            }
            self.sum(block, self.summed, &words);
        }
        Some(())
    }
}

/// The header's bytes from `offset` on, into `piece`.
fn header(offset: usize, piece: &mut [u8]) -> core::ops::Range<usize> {
    let (mut at, mut filled) = (0_usize, 0);
    let written = write_header(DESCRIPTION, |bytes| {
        for (slot, byte) in piece.iter_mut().skip(filled).zip(bytes.iter().skip(offset.saturating_sub(at))) {
            *slot = *byte;
            filled += 1;
        }
        at += bytes.len();
        Ok::<(), core::convert::Infallible>(())
    });
    match written {
        Ok(()) => 0..filled,
    }
}

/// The place of the byte, and the length of the file.
fn find(recorder: &Recorder<'static>, offset: usize) -> (Place, usize) {
    let (mut place, mut start) = (Place::End, HEADER);
    if offset < HEADER {
        place = Place::Header;
    }
    for index in 0..recorder.blocks() {
        let words = recorder.block(index).unwrap_or_default().len();
        let bytes = words * WORD;
        if let Some(byte) = offset.checked_sub(start) {
            if byte < bytes + WORD {
                place = match byte.checked_sub(bytes) {
                    None => Place::Block(index, words, byte),
                    Some(byte) => Place::Checksum(index, words, byte),
                };
            }
        }
        start += bytes + WORD;
    }
    (place, start)
}

/// Copies words of a block, a few at a time. None if it records again.
fn copied(block: usize, first: usize, out: &mut Vec<u64, WORDS>, look: &mut impl RecorderAccess) -> Option<()> {
    for _ in 0..WORDS / AT_ONCE {
        let before = out.len();
        let copy = &mut |recorder: &Recorder<'static>| {
            let words = recorder.block(block).and_then(|words| words.get(first + before..)).unwrap_or_default();
            for word in words.iter().take(AT_ONCE) {
                // There is room for each of them.
                let _ = out.push(*word);
            }
        };
        if !look(copy) {
            return None;
        }
        if out.len() < before + AT_ONCE {
            break;
        }
    }
    Some(())
}
