//! Blocks of equal size in a ring.

use crate::record::{BLOCK_MAGIC, HEADER_WORDS, Layout, NO_TRIGGER};

/// Indices in a block's header.
const WORDS: usize = 1;
const ROWS: usize = 2;
pub(super) const DIGEST: usize = 5;
const TRIGGER: usize = 7;

/// Index of a word in the memory of a ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place(usize);

#[derive(Debug)]
pub(super) struct Ring<'m> {
    memory: &'m mut [u64],
    /// Words of a block, and how many there are.
    size: usize,
    blocks: usize,
    layout: Layout,
    /// The oldest block, and the number of blocks, the open one included.
    oldest: usize,
    held: usize,
    /// Words used in the open block; 0 if none is open.
    used: usize,
    rows: u64,
    /// Start of its last row.
    row: usize,
    lost: u32,
}

/// Room for a row.
pub(super) struct Slots<'a> {
    /// The block.
    block: &'a mut [u64],
    start: usize,
    end: usize,
    used: &'a mut usize,
    rows: &'a mut u64,
}

impl<'m> Ring<'m> {
    pub(super) fn new(memory: &'m mut [u64], size: usize, blocks: usize, layout: Layout) -> Self {
        Self { memory, size, blocks, layout, oldest: 0, held: 0, used: 0, rows: 0, row: 0, lost: 0 }
    }

    pub(super) fn clear(&mut self) {
        (self.oldest, self.held) = (0, 0);
        (self.used, self.rows) = (0, 0);
        self.lost = 0;
    }

    pub(super) fn lost(&self) -> u32 {
        self.lost
    }

    /// Rows of all blocks.
    pub(super) fn rows(&self) -> u64 {
        let mut rows: u64 = 0;
        for k in 0..self.held {
            rows += self.at(k).and_then(|block| block.get(ROWS)).copied().unwrap_or_default();
        }
        rows
    }

    /// Rows of the longest kind that fit into all blocks.
    pub(super) fn capacity(&self) -> usize {
        let room = self.size.saturating_sub(self.layout.preamble());
        self.blocks * room.checked_div(self.layout.longest_row()).unwrap_or_default()
    }

    /// Whether the open block has room for the longest row.
    #[inline]
    pub(super) fn has_room(&self) -> bool {
        self.has_room_for(1)
    }

    /// Whether the open block has room for `rows` rows of the longest kind.
    #[inline]
    pub(super) fn has_room_for(&self, rows: usize) -> bool {
        self.used > 0 && self.used + rows * self.layout.longest_row() <= self.size
    }

    /// Index of the `k`-th block.
    #[inline]
    fn place(&self, k: usize) -> usize {
        let place = self.oldest + k;
        if place >= self.blocks { place - self.blocks } else { place }
    }

    fn at(&self, k: usize) -> Option<&[u64]> {
        let start = self.place(k) * self.size;
        self.memory.get(start..start + self.size)
    }

    fn newest(&mut self) -> Option<&mut [u64]> {
        let start = self.place(self.held.saturating_sub(1)) * self.size;
        self.memory.get_mut(start..start + self.size)
    }

    /// Closes the open block; an empty one is removed.
    pub(super) fn close(&mut self) {
        if self.used == 0 {
            return;
        }
        if self.rows == 0 {
            self.held = self.held.saturating_sub(1);
        }
        self.used = 0;
    }

    /// Closes the open block and begins the next. If no block is free, it replaces the oldest; in a stream, that is a
    /// loss.
    pub(super) fn open(
        &mut self,
        [tick, reason, digest]: [u64; 3],
        config: &[u64],
        save: impl FnOnce(&mut [u64]),
        streaming: bool,
    ) {
        self.close();
        if self.held >= self.blocks {
            self.release();
            self.lost = self.lost.saturating_add(u32::from(streaming));
        }
        self.held += 1;
        self.rows = 0;
        let layout = self.layout;
        self.used = layout.preamble();
        let used = self.used as u64;
        let Some(block) = self.newest() else { return };
        let header = [BLOCK_MAGIC, used, 0, tick, reason, digest, layout.word(), NO_TRIGGER];
        for (slot, word) in block.iter_mut().zip(header.iter().chain(config.iter().take(layout.config))) {
            *slot = *word;
        }
        let first = HEADER_WORDS + layout.config;
        if let Some(state) = block.get_mut(first..first + layout.state) {
            save(state);
        }
    }

    /// Place of the newest block.
    pub(super) fn newest_place(&self) -> Option<Place> {
        (self.held > 0).then(|| Place(self.place(self.held - 1) * self.size))
    }

    /// Writes words at an offset from a place.
    pub(super) fn write(&mut self, Place(place): Place, offset: usize, words: &[u64]) {
        for (slot, word) in self.memory.iter_mut().skip(place + offset).zip(words) {
            *slot = *word;
        }
    }

    /// Whether the last row of the open block has room for one more word.
    pub(super) fn may_add(&self) -> bool {
        self.used > 0 && self.rows > 0 && self.used < self.size
    }

    /// Adds a word to the last row and sets the bit `which` in the row's first word.
    pub(super) fn add(&mut self, which: u64) -> Option<Place> {
        if !self.may_add() {
            return None;
        }
        let (row, used) = (self.row, self.used);
        let block = self.newest()?;
        *block.get_mut(row)? |= which;
        *block.get_mut(WORDS)? = used as u64 + 1;
        self.used = used + 1;
        let Place(first) = self.newest_place()?;
        Some(Place(first + used))
    }

    /// Marks the tick of the trigger.
    pub(super) fn mark(&mut self, tick: u64) {
        if self.used > 0 {
            if let Some(slot) = self.newest().and_then(|block| block.get_mut(TRIGGER)) {
                *slot = tick;
            }
        }
    }

    /// Room for a row; none if no block is open.
    #[inline]
    pub(super) fn row(&mut self) -> Option<Slots<'_>> {
        if !self.has_room() {
            return None;
        }
        let first = self.place(self.held.saturating_sub(1)) * self.size;
        let block = self.memory.get_mut(first..first + self.size)?;
        self.row = self.used;
        Some(Slots { block, start: self.used, end: self.used + 1, used: &mut self.used, rows: &mut self.rows })
    }

    pub(super) fn closed(&self) -> usize {
        if self.used > 0 { self.held.saturating_sub(1) } else { self.held }
    }

    pub(super) fn block(&self, index: usize) -> Option<&[u64]> {
        if index >= self.closed() {
            return None;
        }
        let block = self.at(index)?;
        let words = block.get(WORDS).copied().unwrap_or_default();
        block.get(..words as usize)
    }

    pub(super) fn release(&mut self) {
        if self.closed() > 0 {
            self.oldest = self.place(1);
            self.held -= 1;
        }
    }
}

impl Slots<'_> {
    #[inline]
    pub(super) fn push(&mut self, word: u64) {
        if let Some(slot) = self.block.get_mut(self.end) {
            *slot = word;
        }
        self.end += 1;
    }

    /// Ends the row; `which` is its first word.
    #[inline]
    pub(super) fn finish(self, which: u64) {
        if let Some(slot) = self.block.get_mut(self.start) {
            *slot = which;
        }
        *self.used = self.end;
        *self.rows += 1;
        if let [_, words, rows, ..] = &mut *self.block {
            *words = self.end as u64;
            *rows = *self.rows;
        }
    }
}
