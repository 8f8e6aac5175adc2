//! The recorder: it stores ticks in fixed memory, so that they can be inspected and replayed bit for bit later.
//!
//! ```text
//! start ─► waiting ──trigger──► triggered ──rows after it──► complete      blocks in a ring, the oldest given up
//!      └─► streaming ─────────────────────────────────────► stop           blocks handed out as they fill
//! ```
//! Memory is a slice of the caller, cut into blocks of equal size ([`crate::record`]). Each block begins with the
//! settings and a snapshot of the machine, so that it can be replayed by itself.
//!
//! Before a tick, a target calls [`Recorder::opens`]. If that is true, it calls [`Recorder::open`] with the state of
//! the machine. After the tick it calls [`Recorder::push`]. The emitted controller makes all three calls
//! (`snapshot::supervise_recorded`).
//!
//! A snapshot and a digest take longer than a row. If that is too long for a tick, the background does them
//! ([`Recorder::owing`]). Between two ticks it copies the machine if the recorder [wants](Recorder::wants) a copy, and
//! writes the data while ticks go on. Until then no other block begins, no other row gets a digest, and the memory must
//! not be fetched. If the background is late, rows are left out; no row is ever in a block that it does not continue.

mod ring;

use crate::record::{HAS_DIGEST, HEADER_WORDS, LARGEST_INPUT, Layout, Reason};
use crate::supervisor::Phase;
use ring::{DIGEST, Place, Ring};

/// Events that trigger a recorder, besides [`Recorder::trigger`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Trigger {
    /// A fault: the phase changes to [`Trigger::FAULTED`].
    pub fault: bool,
    /// Any change of phase.
    pub phase_change: bool,
}

impl Trigger {
    /// Word of the phase that is a fault.
    pub const FAULTED: u32 = Phase::Faulted.word() as u32;
}

/// How a recorder records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Blocks are handed out as they fill, and nothing triggers.
    pub streaming: bool,
    /// What triggers.
    pub trigger: Trigger,
    /// Rows recorded after the trigger, ≥ 1. The rest of the memory holds rows from before it.
    pub after: u32,
    /// Every n-th tick is recorded, ≥ 1. Above 1 a record covers more time but cannot be replayed.
    pub decimation: u32,
    /// Every n-th row ends with a digest of the machine; 0 for none. It costs the target about as much as a row.
    pub digest_every: u32,
}

impl Settings {
    /// Every tick, handed out block by block.
    pub const STREAM: Self = Self {
        streaming: true,
        trigger: Trigger { fault: false, phase_change: false },
        after: 1,
        decimation: 1,
        digest_every: 1,
    };
}

/// State of a recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// Not recording; the memory is kept.
    Stopped,
    /// Recording before the trigger.
    Waiting,
    /// Recording after the trigger: this number of rows remains.
    Triggered(u32),
    /// The record is complete.
    Complete,
    /// Recording; blocks are handed out as they fill.
    Streaming,
}

/// Outputs of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Converter codes.
    pub codes: [i32; 6],
    /// Status of the tick.
    pub status: u32,
    /// Phase, cause << 8, amplifiers on << 16.
    pub supervisor: u32,
}

/// Reason why a memory cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryError {
    /// There is no room for this number of blocks with a row each, or fewer than two blocks were requested: words
    /// needed.
    TooSmall(usize),
    /// The input has more words than a row can mark as changed.
    InputTooLong,
}

/// Records ticks in memory of the caller.
#[derive(Debug)]
pub struct Recorder<'m> {
    ring: Ring<'m>,
    layout: Layout,
    settings: Settings,
    activity: Activity,
    /// Ticks since the recorder was made.
    tick: u64,
    /// Ticks until the next recorded one.
    skip: u32,
    /// Rows until the next digest.
    digest_in: u32,
    /// Reason why the next row must begin a new block.
    due: Option<Reason>,
    /// A trigger was requested.
    asked: bool,
    /// Phase of the last tick.
    phase: u32,
    /// Input of the last row; the next row stores its changes.
    last: [u64; LARGEST_INPUT],
    /// Digest of the present state, if the last row has it.
    digest: Option<u64>,
    /// Whether the background writes snapshots and digests, and the pending one.
    owing: bool,
    owed: Option<PendingWrite>,
}

/// Purpose of a copy of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SnapshotPurpose {
    /// A block begins with it, after the present settings.
    Block,
    /// Its digest ends the last row.
    Digest,
}

/// A block begins early: when this number of rows fits into the open one.
const AHEAD: usize = 8;

/// Destination of data that the background writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PendingWrite {
    /// Settings, state and digest at the start of a block.
    Block(Place),
    /// The digest of a row.
    Digest(Place),
    /// None: the block was discarded.
    Nothing,
}

impl<'m> Recorder<'m> {
    /// A stopped recorder that cuts `memory` into `blocks` (≥ 2) blocks.
    ///
    /// # Errors
    /// The blocks do not fit into the memory.
    pub fn new(memory: &'m mut [u64], blocks: usize, layout: Layout) -> Result<Self, MemoryError> {
        if layout.input > LARGEST_INPUT {
            return Err(MemoryError::InputTooLong);
        }
        let least = layout.preamble() + layout.longest_row();
        let size = memory.len().checked_div(blocks).unwrap_or_default();
        if blocks < 2 || size < least {
            return Err(MemoryError::TooSmall(least.saturating_mul(if blocks < 2 { 2 } else { blocks })));
        }
        Ok(Self {
            ring: Ring::new(memory, size, blocks, layout),
            layout,
            settings: Settings::STREAM,
            activity: Activity::Stopped,
            tick: 0,
            skip: 0,
            digest_in: 0,
            due: None,
            asked: false,
            phase: 0,
            last: [0; LARGEST_INPUT],
            digest: None,
            owing: false,
            owed: None,
        })
    }

    /// Leaves snapshots and digests to the background, see [`Recorder::wants`].
    #[must_use]
    pub fn owing(self) -> Self {
        Self { owing: true, ..self }
    }

    /// Discards the memory and records from the next tick on.
    pub fn start(&mut self, settings: Settings) {
        self.ring.clear();
        self.settings = settings;
        self.activity = if settings.streaming { Activity::Streaming } else { Activity::Waiting };
        self.skip = 0;
        self.digest_in = 0;
        self.asked = false;
        self.due = Some(Reason::Started);
        self.digest = None;
        self.owed = self.owed.map(|_| PendingWrite::Nothing);
    }

    /// Ends the recording; the memory can still be fetched.
    pub fn stop(&mut self) {
        self.ring.close();
        if self.activity != Activity::Complete {
            self.activity = Activity::Stopped;
        }
    }

    /// Triggers with the next row.
    pub fn trigger(&mut self) {
        self.asked = true;
    }

    /// The controller was reset: the next row begins a block that does not continue the last one.
    pub fn restarted(&mut self) {
        self.due = Some(Reason::Started);
        self.digest = None;
    }

    /// The controller's settings changed: the next row begins a block with the new ones.
    pub fn settings_changed(&mut self) {
        if self.due.is_none() {
            self.due = Some(Reason::Settings);
        }
    }

    /// The next row is that of `tick` and begins a block. If `tick` does not follow the last one, the block does not
    /// continue the one before. For a recorder that changes its place or misses ticks.
    pub fn begin(&mut self, tick: u64) {
        if tick != self.tick {
            self.tick = tick;
            self.due = Some(Reason::Started);
            self.digest = None;
        } else if self.due.is_none() {
            self.due = Some(Reason::Continued);
        }
    }

    /// What it does.
    #[must_use]
    pub fn activity(&self) -> Activity {
        self.activity
    }

    /// Ticks since the recorder was made.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Blocks lost while streaming: they were overwritten before they were fetched.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.ring.lost()
    }

    fn records(&self) -> bool {
        !matches!(self.activity, Activity::Stopped | Activity::Complete)
    }

    /// Before a tick: whether a block begins with it. Then [`Recorder::open`] must be called.
    #[inline]
    #[must_use]
    pub fn opens(&self) -> bool {
        self.records() && self.skip == 0 && (self.due.is_some() || !self.ring.has_room())
    }

    /// Begins a block before a tick, with the settings of the tick, the digest of the present state, and the state,
    /// which `save` writes.
    pub fn open(&mut self, config: &[u64], digest: u64, save: impl FnOnce(&mut [u64])) {
        self.open_with(config, || digest, save);
    }

    /// The same with a digest that is computed only if the previous row has none. The last row of a full block has one,
    /// so that a single tick does not pay for both.
    pub fn open_with(&mut self, config: &[u64], digest: impl FnOnce() -> u64, save: impl FnOnce(&mut [u64])) {
        let reason = self.due.take().unwrap_or(Reason::Continued).word() | u64::from(self.settings.decimation) << 32;
        let digest = self.digest.take().unwrap_or_else(digest);
        self.ring.open([self.tick, reason, digest], config, save, self.settings.streaming);
        self.last = [0; LARGEST_INPUT];
        // The digest of the block's start also serves its first row.
        if self.settings.digest_every > 1 {
            self.digest_in = self.settings.digest_every - 1;
        }
    }

    // This and what follows is cold: small before fast.
    /// Between two ticks: whether a copy of the machine is needed now, and for what. Then call [`Recorder::owe`].
    #[cold]
    #[must_use]
    pub fn wants(&self) -> Option<SnapshotPurpose> {
        let records = self.owing && self.records() && self.skip == 0 && !self.owes();
        let every = self.settings.digest_every;
        match () {
            // Before the open block is full, so that no row is left out.
            () if records && (self.due.is_some() || !self.ring.has_room_for(AHEAD)) => Some(SnapshotPurpose::Block),
            // For the last row, which is that of the last tick.
            () if records
                && self.settings.decimation <= 1
                && every > 0
                && self.digest_in == 0
                && self.ring.may_add() =>
            {
                Some(SnapshotPurpose::Digest)
            }
            () => None,
        }
    }

    /// The copy was made: a block begins with the next row, or the last row ends with a digest. The data follows later.
    #[cold]
    pub fn owe(&mut self, want: SnapshotPurpose) {
        self.owed = match want {
            SnapshotPurpose::Block => {
                self.open_with(&[], || 0, |_| {});
                self.ring.newest_place().map(PendingWrite::Block)
            }
            SnapshotPurpose::Digest => {
                self.digest_in = self.settings.digest_every;
                self.ring.add(HAS_DIGEST).map(PendingWrite::Digest)
            }
        };
    }

    /// Whether data is pending.
    #[inline]
    #[must_use]
    pub fn owes(&self) -> bool {
        self.owed.is_some()
    }

    /// Whether a whole block start is pending, not only a digest.
    #[must_use]
    pub fn owes_block(&self) -> bool {
        matches!(self.owed, Some(PendingWrite::Block(_)))
    }

    /// Writes words of a pending block start (settings, then state) from the `first`-th on.
    #[cold]
    pub fn hand_in(&mut self, first: usize, words: &[u64]) {
        if let Some(PendingWrite::Block(place)) = self.owed {
            if first + words.len() <= self.layout.config + self.layout.state {
                self.ring.write(place, HEADER_WORDS + first, words);
            }
        }
    }

    /// Writes the digest, the last part of pending data.
    #[cold]
    pub fn settle(&mut self, digest: u64) {
        match self.owed.take() {
            Some(PendingWrite::Block(place)) => self.ring.write(place, DIGEST, &[digest]),
            Some(PendingWrite::Digest(place)) => self.ring.write(place, 0, &[digest]),
            Some(PendingWrite::Nothing) | None => {}
        }
    }

    /// After a tick: its input words and outputs. `digest` computes the digest of the machine if one is due.
    #[inline]
    pub fn push(&mut self, input: &[u64], row: &Row, digest: impl FnOnce() -> u64) {
        let tick = self.tick;
        self.tick += 1;
        self.digest = None;
        if !self.records() {
            return;
        }
        let phase = row.supervisor & 0xff;
        self.look(tick, phase);
        if self.skip > 0 {
            self.skip -= 1;
            return;
        }
        self.skip = self.settings.decimation.saturating_sub(1);
        self.write(input, row, digest);
        if let Activity::Triggered(left) = self.activity {
            self.activity = if left > 1 { Activity::Triggered(left - 1) } else { Activity::Complete };
            if left <= 1 {
                self.ring.close();
            }
        }
    }

    /// Whether this tick triggers.
    #[inline]
    fn look(&mut self, tick: u64, phase: u32) {
        let changed = phase != self.phase && tick > 0;
        self.phase = phase;
        if self.activity != Activity::Waiting {
            return;
        }
        let Trigger { fault, phase_change } = self.settings.trigger;
        if self.asked || (phase_change && changed) || (fault && changed && phase == Trigger::FAULTED) {
            self.asked = false;
            self.activity = Activity::Triggered(if self.settings.after > 0 { self.settings.after } else { 1 });
            self.ring.mark(tick);
        }
    }

    #[inline]
    fn write(&mut self, input: &[u64], row: &Row, digest: impl FnOnce() -> u64) {
        if self.owing && (self.due.is_some() || !self.ring.has_room()) {
            // No block began with this row: the next block does not continue the last one.
            self.due = Some(Reason::Started);
            return;
        }
        let every = self.settings.digest_every;
        let full = !self.ring.has_room_for(2);
        let has_digest = every > 0 && (self.digest_in == 0 || full) && !self.owing;
        self.digest_in = if has_digest { every - 1 } else { self.digest_in.saturating_sub(1) };
        let Some(mut slots) = self.ring.row() else { return };
        let mut which = if has_digest { HAS_DIGEST } else { 0 };
        let mut bit = 1;
        for (last, word) in self.last.iter_mut().zip(input).take(self.layout.input) {
            if *last != *word {
                *last = *word;
                which |= bit;
                slots.push(*word);
            }
            bit <<= 1;
        }
        let [a, b, c, d, e, f] = row.codes.map(|code| u64::from(code as u32));
        slots.push(a | b << 32);
        slots.push(c | d << 32);
        slots.push(e | f << 32);
        slots.push(u64::from(row.status) | u64::from(row.supervisor) << 32);
        if has_digest {
            let digest = digest();
            slots.push(digest);
            self.digest = Some(digest);
        }
        slots.finish(which);
    }

    /// Rows in memory, including those of the open block.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.ring.rows()
    }

    /// Rows that fit even if every input word changes. More fit if less changes.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.ring.capacity()
    }

    /// Blocks that can be fetched: closed ones, and the open one after the end of the recording.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.ring.closed()
    }

    /// The `index`-th block, the oldest first.
    #[must_use]
    pub fn block(&self, index: usize) -> Option<&[u64]> {
        self.ring.block(index)
    }

    /// Frees the oldest block after it was fetched. For streams.
    pub fn release(&mut self) {
        self.ring.release();
    }
}
