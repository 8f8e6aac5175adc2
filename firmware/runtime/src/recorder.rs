//! The recorder: ticks kept in fixed memory, so that they can be looked at, and replayed bit for bit, after the event.
//!
//! ```text
//! start ─► waiting ──trigger──► triggered ──rows after it──► complete      blocks in a ring, the oldest given up
//!      └─► streaming ─────────────────────────────────────► stop           blocks handed out as they fill
//! ```
//! Memory is a slice of the caller, cut into blocks of equal size ([`crate::record`]). Each begins with the settings and a
//! snapshot of the machine, so that every block that is left can be replayed by itself.
//!
//! A target calls [`Recorder::opens`] before a tick and, if it says so, [`Recorder::open`] with the machine as it is then;
//! after the tick [`Recorder::push`]. The emitted controller does all three (`snapshot::supervise_recorded`).
//!
//! Snapshot and digest take longer than a row. Where that is too long for a tick, they are the work of the background
//! ([`Recorder::owing`]): between two ticks it keeps a copy of the machine, if the recorder [wants](Recorder::wants) one, and hands in
//! what is then owed while ticks go on. Until that is done no other block begins, no other row gets a digest, and what it holds is not
//! to be fetched. A background that is late leaves rows out, and never a row in a block that it does not continue.

mod ring;

use crate::record::{HAS_DIGEST, HEADER_WORDS, LARGEST_INPUT, Layout, Reason};
use crate::supervisor::Phase;
use ring::{DIGEST, Place, Ring};

/// What makes a recorder keep what it has, besides [`Recorder::trigger`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Trigger {
    /// A fault: the phase becomes [`Trigger::FAULTED`].
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
    /// Rows that are recorded after the trigger, ≥ 1: the rest of the memory is what was before it.
    pub after: u32,
    /// Every so-manieth tick is recorded, ≥ 1. Above 1 a record shows more time but cannot be replayed.
    pub decimation: u32,
    /// Every so-manieth row ends with a digest of the machine; 0 for none. It costs the target about as much as a row.
    pub digest_every: u32,
}

impl Settings {
    /// Everything, handed out block by block.
    pub const STREAM: Self = Self {
        streaming: true,
        trigger: Trigger { fault: false, phase_change: false },
        after: 1,
        decimation: 1,
        digest_every: 1,
    };
}

/// What a recorder does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// Nothing; what it has stays.
    Stopped,
    /// Records, and waits for the trigger.
    Waiting,
    /// Records what comes after it: so many rows more.
    Triggered(u32),
    /// Has what it was to record.
    Complete,
    /// Records, and hands out.
    Streaming,
}

/// What a tick put out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Converter codes.
    pub codes: [i32; 6],
    /// Status of the tick.
    pub status: u32,
    /// Phase, cause << 8, amplifiers on << 16.
    pub supervisor: u32,
}

/// Why a memory is not enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryError {
    /// It has no room for so many blocks of a row each, or there are fewer than two of them: words needed.
    TooSmall(usize),
    /// An input of more words than a row can tell apart.
    InputTooLong,
}

/// Records ticks in the memory of a caller.
#[derive(Debug)]
pub struct Recorder<'m> {
    ring: Ring<'m>,
    layout: Layout,
    settings: Settings,
    activity: Activity,
    /// Ticks seen since it was made.
    tick: u64,
    /// Ticks until the next one that is recorded.
    skip: u32,
    /// Rows until the next digest.
    digest_in: u32,
    /// A new block must begin with the next row, and why.
    due: Option<Reason>,
    /// Asked for from outside.
    asked: bool,
    /// Phase of the last tick.
    phase: u32,
    /// Input of the last row, by which the next is told.
    last: [u64; LARGEST_INPUT],
    /// Digest of the machine as it is, where the last row has it.
    digest: Option<u64>,
    /// Snapshots and digests come later, and which does.
    owing: bool,
    owed: Option<PendingWrite>,
}

/// For what a machine is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SnapshotPurpose {
    /// A block begins with it, after the settings that are in force.
    Block,
    /// Its digest ends the last row.
    Digest,
}

/// Rows that a block has left when the next is to begin.
const AHEAD: usize = 8;

/// Where what comes later goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PendingWrite {
    /// Settings, state and digest that a block begins with.
    Block(Place),
    /// The digest of a row.
    Digest(Place),
    /// Nowhere: what it was for is forgotten.
    Nothing,
}

impl<'m> Recorder<'m> {
    /// A stopped recorder that cuts `memory` into `blocks` (≥ 2) blocks.
    ///
    /// # Errors
    /// There is no room for that.
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

    /// The same, whose snapshots and digests are the work of a background: see [`Recorder::wants`].
    #[must_use]
    pub fn owing(self) -> Self {
        Self { owing: true, ..self }
    }

    /// Forgets what it has and records from the next tick on.
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

    /// Ends the recording; what there is stays to be fetched.
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

    /// The controller was reset: a block that does not continue the last one begins with the next row.
    pub fn restarted(&mut self) {
        self.due = Some(Reason::Started);
        self.digest = None;
    }

    /// The settings of the controller changed: a block with the new ones begins with the next row.
    pub fn settings_changed(&mut self) {
        if self.due.is_none() {
            self.due = Some(Reason::Settings);
        }
    }

    /// The next row is that of `tick`, and a block begins with it; where that is not the tick after the last one, the block
    /// does not continue what was before. For a recorder that is handed from one place to another, or misses ticks.
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

    /// Ticks seen since it was made.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Blocks that were given up before anyone had fetched them, while streaming.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.ring.lost()
    }

    fn records(&self) -> bool {
        !matches!(self.activity, Activity::Stopped | Activity::Complete)
    }

    /// Before a tick: whether a block begins with it, which [`Recorder::open`] must be called for.
    #[inline]
    #[must_use]
    pub fn opens(&self) -> bool {
        self.records() && self.skip == 0 && (self.due.is_some() || !self.ring.has_room())
    }

    /// Begins a block, before a tick, with the settings that the tick runs under, the digest of the machine as it is, and its
    /// state, which `save` writes.
    pub fn open(&mut self, config: &[u64], digest: u64, save: impl FnOnce(&mut [u64])) {
        self.open_with(config, || digest, save);
    }

    /// The same with a digest that is asked for only where the row before has none. The last row of a full block has one, so that
    /// not everything falls into one tick.
    pub fn open_with(&mut self, config: &[u64], digest: impl FnOnce() -> u64, save: impl FnOnce(&mut [u64])) {
        let reason = self.due.take().unwrap_or(Reason::Continued).word() | u64::from(self.settings.decimation) << 32;
        let digest = self.digest.take().unwrap_or_else(digest);
        self.ring.open([self.tick, reason, digest], config, save, self.settings.streaming);
        self.last = [0; LARGEST_INPUT];
        // What the block begins with is as good as a digest of its first row.
        if self.settings.digest_every > 1 {
            self.digest_in = self.settings.digest_every - 1;
        }
    }

    // Cold, as what follows: small before fast.
    /// Between two ticks: for what the machine as it is now is to be kept, if for anything. Then [`Recorder::owe`].
    #[cold]
    #[must_use]
    pub fn wants(&self) -> Option<SnapshotPurpose> {
        let records = self.owing && self.records() && self.skip == 0 && !self.owes();
        let every = self.settings.digest_every;
        match () {
            // Before the open block is full, so that no row is without one.
            () if records && (self.due.is_some() || !self.ring.has_room_for(AHEAD)) => Some(SnapshotPurpose::Block),
            // Of the last row, which is that of the last tick.
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

    /// It is kept: a block begins with the next row, or the last row ends with a digest. Both are owed.
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

    /// Whether something is owed.
    #[inline]
    #[must_use]
    pub fn owes(&self) -> bool {
        self.owed.is_some()
    }

    /// Whether that is a whole block, settings and state and all, or the digest alone.
    #[must_use]
    pub fn owes_block(&self) -> bool {
        matches!(self.owed, Some(PendingWrite::Block(_)))
    }

    /// Words of what an owed block begins with, settings and then state, from the `first`-th on.
    #[cold]
    pub fn hand_in(&mut self, first: usize, words: &[u64]) {
        if let Some(PendingWrite::Block(place)) = self.owed {
            if first + words.len() <= self.layout.config + self.layout.state {
                self.ring.write(place, HEADER_WORDS + first, words);
            }
        }
    }

    /// The digest, which is the last that is owed.
    #[cold]
    pub fn settle(&mut self, digest: u64) {
        match self.owed.take() {
            Some(PendingWrite::Block(place)) => self.ring.write(place, DIGEST, &[digest]),
            Some(PendingWrite::Digest(place)) => self.ring.write(place, 0, &[digest]),
            Some(PendingWrite::Nothing) | None => {}
        }
    }

    /// After a tick: its input words and what came out. `digest` gives that of the machine, where one is due.
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
            // No block has begun with it: the next one does not continue what is there.
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

    /// Rows in memory, those of the open block included.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.ring.rows()
    }

    /// Rows that fit whatever changes in them; there is room for more where less changes.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.ring.capacity()
    }

    /// Blocks that can be fetched: closed ones, and the open one where recording has ended.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.ring.closed()
    }

    /// The `index`-th of them, the oldest first.
    #[must_use]
    pub fn block(&self, index: usize) -> Option<&[u64]> {
        self.ring.block(index)
    }

    /// The oldest of them was fetched: its place may be used again. For streams.
    pub fn release(&mut self) {
        self.ring.release();
    }
}
