//! Samples of a machine for subscribed hosts: ticks become rows, rows blocks, and blocks wait in fixed memory until the
//! host asks.
//!
//! ```text
//! every tick ─ Sample ─► Collector ── Row of `every` ticks ──► Block of rows ──► ring ──► Reply::Samples
//!                        least, mean, most                      numbered          the oldest is given up
//! ```
//! Blocks are made and numbered whether or not a host fetches them: a lost block is a gap in the numbers. Ticks that
//! did not reach the collector are a gap between the ticks of two blocks. If a gap cuts a row off, its ticks are a row
//! of their own, in a block with that length: no sampled tick is left out.

use serde::Serialize;

use crate::bytes::Bytes;
use crate::message::Reply;

/// Axes of a pose, and legs.
pub const AXES: usize = 6;
/// Most ticks of a row.
pub const MOST_EVERY: u32 = 1_000_000;
/// Bytes of a row of one tick: status, phase, pose, set-point, error, voltages.
pub const ROW_OF_ONE: usize = 4 + 1 + 4 * AXES * NUMBER;
/// Bytes of a row of several: errors and voltages as least, mean and most.
pub const ROW: usize = 4 + 1 + (2 + 3 + 3) * AXES * NUMBER;
/// Most bytes of a block.
pub const BLOCK: usize = 5 * ROW;

const NUMBER: usize = size_of::<f32>();
/// Values of a row with least, mean and most over its ticks.
const SPREADS: usize = 2 * AXES;
// Overhead of a reply with a block: variant, number, tick, ticks per row, whether there are more, length.
const _: () = assert!(BLOCK + (1 + 5 + 10 + 3 + 1 + 2) <= crate::MESSAGE);
const _: () = assert!(MOST_EVERY < 1 << 21, "three bytes in a message");

/// Results of a tick. Poses are the platform's: from rest and with the bias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Ticks since power-up.
    pub tick: u64,
    /// The controller's status word.
    pub status: u32,
    /// Number of `supervisor::Phase`.
    pub phase: u8,
    /// Pose measured, m and rad.
    pub pose: [f32; AXES],
    /// Set-point, m and rad.
    pub target: [f32; AXES],
    /// Set-point less pose, rounded to 32 bits after the subtraction, m and rad.
    pub error: [f32; AXES],
    /// Voltage of each leg, V.
    pub volts: [f32; AXES],
}

/// Statistics of a value over the ticks of a row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spread {
    /// The least.
    pub least: f32,
    /// The mean: the sum in order with compensated rounding (Kahan), divided by the number of ticks.
    pub mean: f32,
    /// The most.
    pub most: f32,
}

/// Consecutive ticks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Row {
    /// Union of their status words.
    pub status: u32,
    /// Number of the last phase.
    pub phase: u8,
    /// Last measured pose, m and rad.
    pub pose: [f32; AXES],
    /// Last set-point, m and rad.
    pub target: [f32; AXES],
    /// Set-point less pose, m and rad.
    pub error: [Spread; AXES],
    /// Voltage of each leg, V.
    pub volts: [Spread; AXES],
}

/// Rows as bytes, with their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Number of the block.
    pub number: u32,
    /// First tick of the first row.
    pub tick: u64,
    /// Ticks of each row.
    pub every: u32,
    bytes: [u8; BLOCK],
    length: usize,
}

impl Block {
    /// Of no rows.
    pub const EMPTY: Self = Self { number: 0, tick: 0, every: 0, bytes: [0; BLOCK], length: 0 };

    /// The rows, for [`rows`].
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// As an answer; `more`: whether a complete block waits after it.
    #[must_use]
    pub fn reply(&self, more: bool) -> Reply<'_> {
        let Self { number, tick, every, .. } = *self;
        Reply::Samples { number, tick, every, more, rows: Bytes(self.bytes()) }
    }

    fn is_full(&self) -> bool {
        self.length + row_of(self.every) > BLOCK
    }
}

/// Bytes of a row of this many ticks.
#[must_use]
pub const fn row_of(every: u32) -> usize {
    if every == 1 { ROW_OF_ONE } else { ROW }
}

/// The rows of a block, of `every` ticks each; none if the bytes are not whole ones.
#[must_use]
pub fn rows(every: u32, bytes: &[u8]) -> Option<impl ExactSizeIterator<Item = Row> + '_> {
    let rows = bytes.chunks_exact(row_of(every));
    rows.remainder().is_empty().then(|| rows.map(move |bytes| Row::read(every, bytes)))
}

impl Row {
    fn read(every: u32, bytes: &[u8]) -> Self {
        let (status, rest) = bytes.split_first_chunk().unwrap_or((&[0; 4], &[]));
        let (phase, rest) = rest.split_first().unwrap_or((&0, &[]));
        let mut numbers = rest.chunks_exact(4).map(|number| f32::from_le_bytes(number.try_into().unwrap_or_default()));
        let mut next = || numbers.next().unwrap_or(0.0);
        let (pose, target) = ([(); AXES].map(|()| next()), [(); AXES].map(|()| next()));
        let mut spread = || {
            let least = next();
            if every == 1 {
                Spread { least, mean: least, most: least }
            } else {
                Spread { least, mean: next(), most: next() }
            }
        };
        let (error, volts) = ([(); AXES].map(|()| spread()), [(); AXES].map(|()| spread()));
        Self { status: u32::from_le_bytes(*status), phase: *phase, pose, target, error, volts }
    }
}

/// A value so far.
#[derive(Debug, Clone, Copy)]
struct Sum {
    least: f32,
    most: f32,
    sum: f32,
    /// Rounding error of the sum.
    lost: f32,
}

impl Sum {
    const fn of(value: f32) -> Self {
        Self { least: value, most: value, sum: value, lost: 0.0 }
    }

    /// Adds a value by Kahan's summation.
    fn add(&mut self, value: f32) {
        if value < self.least {
            self.least = value;
        }
        if value > self.most {
            self.most = value;
        }
        let value = value - self.lost;
        let sum = self.sum + value;
        self.lost = (sum - self.sum) - value;
        self.sum = sum;
    }
}

/// Makes blocks of the ticks, in the memory `S` of at least two blocks: one is being filled.
#[derive(Debug)]
pub struct Collector<S> {
    ring: S,
    /// Waiting blocks: the oldest, and their number. The one after them is being filled.
    first: usize,
    waiting: usize,
    /// Number of the block being filled.
    number: u32,
    /// Ticks per row; 0 without a subscriber.
    every: u32,
    /// Ticks of the open row, its first one, and the next tick.
    count: u32,
    begun: u64,
    next: u64,
    /// The last of them, with the union of their status bits.
    last: Sample,
    sums: [Sum; SPREADS],
}

impl<S: AsRef<[Block]> + AsMut<[Block]>> Collector<S> {
    /// Nobody looks on.
    #[must_use]
    pub const fn new(ring: S) -> Self {
        let nothing = [0.0; AXES];
        let last =
            Sample { tick: 0, status: 0, phase: 0, pose: nothing, target: nothing, error: nothing, volts: nothing };
        let sums = [Sum::of(0.0); SPREADS];
        Self { ring, first: 0, waiting: 0, number: 0, every: 0, count: 0, begun: 0, next: 0, last, sums }
    }

    /// Starts rows of `every` ticks; 0 stops them. Waiting blocks are dropped; numbers restart at 0.
    pub fn start(&mut self, every: u32) {
        (self.every, self.number) = (every, 0);
        (self.first, self.waiting, self.count) = (0, 0, 0);
        if let Some(open) = self.open() {
            open.length = 0;
        }
    }

    /// Ticks per row; 0 without a subscriber.
    #[must_use]
    pub const fn every(&self) -> u32 {
        self.every
    }

    /// Blocks that wait whole.
    #[must_use]
    pub const fn waiting(&self) -> usize {
        self.waiting
    }

    /// Takes a tick.
    pub fn add(&mut self, sample: &Sample) {
        if self.every == 0 {
            return;
        }
        if sample.tick != self.next {
            self.cut();
        }
        let status = if self.count == 0 { 0 } else { self.last.status };
        let values = sample.error.iter().chain(&sample.volts);
        for (sum, value) in self.sums.iter_mut().zip(values) {
            if self.count == 0 {
                *sum = Sum::of(*value);
            } else {
                sum.add(*value);
            }
        }
        if self.count == 0 {
            self.begun = sample.tick;
        }
        self.last = Sample { status: sample.status | status, ..*sample };
        self.next = sample.tick.wrapping_add(1);
        self.count += 1;
        if self.count >= self.every {
            self.put();
        }
    }

    /// Removes and returns the oldest block: a complete one, otherwise the part of the one being filled. None if there
    /// are no rows.
    pub fn take(&mut self) -> Option<&Block> {
        if self.waiting == 0 {
            self.close();
        }
        self.waiting = self.waiting.checked_sub(1)?;
        let oldest = self.first;
        self.first = self.place(1);
        self.ring.as_ref().get(oldest)
    }

    /// Ends block and row at a gap.
    fn cut(&mut self) {
        self.close();
        if self.count > 0 {
            self.put();
            self.close();
        }
    }

    /// Writes the open row, however many ticks it has.
    fn put(&mut self) {
        let Self { last, sums, count, begun, number, .. } = *self;
        self.count = 0;
        let Some(block) = self.open() else { return };
        if block.length == 0 {
            (block.number, block.tick, block.every) = (number, begun, count);
        }
        let start = last.status.to_le_bytes().into_iter().chain([last.phase]);
        let ends = last.pose.into_iter().chain(last.target);
        let spreads = sums.into_iter().flat_map(|Sum { least, most, sum, .. }| {
            let mean = sum / count as f32;
            // Rounding must not put the mean outside the range of the values.
            let mean = if mean < least { least } else { mean };
            [least, if mean > most { most } else { mean }, most].into_iter().take(if count == 1 { 1 } else { 3 })
        });
        let bytes = start.chain(ends.chain(spreads).flat_map(f32::to_le_bytes));
        for (slot, byte) in block.bytes.iter_mut().skip(block.length).zip(bytes) {
            *slot = byte;
            block.length += 1;
        }
        if block.is_full() {
            self.close();
        }
    }

    /// Closes the block being filled, if it has rows. Without room the oldest block is dropped.
    fn close(&mut self) {
        if self.open().is_none_or(|block| block.length == 0) {
            return;
        }
        self.number = self.number.wrapping_add(1);
        if self.waiting + 1 < self.ring.as_ref().len() {
            self.waiting += 1;
        } else {
            self.first = self.place(1);
        }
        if let Some(block) = self.open() {
            block.length = 0;
        }
    }

    fn open(&mut self) -> Option<&mut Block> {
        let place = self.place(self.waiting);
        self.ring.as_mut().get_mut(place)
    }

    /// Place of the block at this distance after the oldest.
    fn place(&self, behind: usize) -> usize {
        (self.first + behind).checked_rem(self.ring.as_ref().len()).unwrap_or(0)
    }
}
