//! Samples for a subscribed host: a tick stores a copy of its results, the background makes rows of the copies.

use core::mem::MaybeUninit;

use controller::limits::DAC;
use controller::supervised::{Machine, MachineOutput};
use controller::{LEGS, PLACE_WORDS, Real, passes};
use heapless::spsc::Queue;
use specgen_link::Refusal;
use specgen_link::samples::{AXES, Block, Collector, MOST_EVERY, ROW, ROW_OF_ONE, Sample};

use crate::words::PERIOD_NANOSECONDS;

/// Most waiting copies: enough for the time in which the background makes a frame of 1 KiB.
pub(crate) const COPIES: usize = 32;
/// Blocks: one that is being filled, and two that wait.
const BLOCKS: usize = 3;
/// Bits that a byte takes on the line.
const BITS: u64 = 10;
/// Overhead of a frame with five rows, per row.
const FRAME: usize = 8;
/// Whether there is a pose: six legs have none.
pub(crate) const POSSIBLE: bool = PLACE_WORDS > 0;

/// What a tick leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TickSample {
    tick: u64,
    status: u32,
    phase: u8,
    /// Set-point and pose.
    shown: [[Real; AXES]; 2],
    codes: [i32; LEGS],
}

impl TickSample {
    pub(crate) fn sample(&self) -> Sample {
        let Self { tick, status, phase, shown, codes } = *self;
        sample(tick, status, phase, shown, codes.map(|code| DAC.voltage(code)))
    }
}

/// A tick's results for a host: `shown` are set-point and pose, `volts` the voltages of the legs.
#[must_use]
pub fn sample(tick: u64, status: u32, phase: u8, shown: [[Real; AXES]; 2], volts: [Real; LEGS]) -> Sample {
    let rounded = |values: [Real; AXES]| values.map(|value| value as f32);
    let [target, pose] = shown;
    let mut error = target;
    for (error, pose) in error.iter_mut().zip(pose) {
        *error -= pose;
    }
    let (pose, target, error, volts) = (rounded(pose), rounded(target), rounded(error), rounded(volts));
    Sample { tick, status, phase, pose, target, error, volts }
}

/// Memory for samples, 6 KiB. It need not be initialised.
#[derive(Debug)]
pub struct SampleMemory {
    copies: MaybeUninit<Copies>,
    rows: Rows,
}

/// A queue holds one item less than its size.
type Copies = Queue<TickSample, { COPIES + 1 }>;
pub(crate) type Rows = Collector<[Block; BLOCKS]>;

impl Default for SampleMemory {
    fn default() -> Self {
        Self::new()
    }
}

impl SampleMemory {
    /// Copies that are not initialised, and empty blocks.
    #[must_use]
    pub const fn new() -> Self {
        Self { copies: MaybeUninit::uninit(), rows: Collector::new([Block::EMPTY; BLOCKS]) }
    }
}

/// Samples between tick and background.
#[derive(Debug)]
pub(crate) struct Samples {
    /// Ticks per row; 0 without a subscriber.
    pub(crate) every: u32,
    /// Whether rows restart; also at power-up, when their memory is not initialised.
    pub(crate) anew: bool,
    copies: &'static mut Copies,
    /// None while the background uses it.
    pub(crate) rows: Option<&'static mut Rows>,
    /// Bits per second of the line.
    baud: u32,
}

impl Samples {
    pub(crate) fn new(memory: &'static mut SampleMemory, baud: u32) -> Self {
        let SampleMemory { copies, rows } = memory;
        let copies = copies.write(Queue::new());
        Self { every: 0, anew: true, copies, rows: Some(rows), baud }
    }

    /// Starts rows of `every` ticks; 0 stops them.
    pub(crate) fn start(&mut self, every: u32) -> Result<(), Refusal> {
        if every > MOST_EVERY {
            return Err(Refusal::Word { index: 0 });
        }
        if every > 0 && !fits(every, self.baud) {
            return Err(Refusal::Rate { least: least(self.baud) });
        }
        (self.every, self.anew) = (every, true);
        *self.copies = Queue::new();
        Ok(())
    }

    /// Stores a copy of a tick's results, if a host is subscribed. Without room it is dropped: a gap between ticks.
    #[inline]
    pub(crate) fn keep(&mut self, tick: u64, machine: &Machine, output: &MachineOutput) {
        if self.every > 0 {
            self.copy(tick, machine, output);
        }
    }

    #[inline(never)]
    fn copy(&mut self, tick: u64, machine: &Machine, output: &MachineOutput) {
        let Some(shown) = passes::shown(&machine.state) else { return };
        let (status, phase) = (output.tick.status, output.phase.word() as u8);
        let _ = self.copies.enqueue(TickSample { tick, status, phase, shown, codes: output.tick.dac_code });
    }

    pub(crate) fn pop(&mut self) -> Option<TickSample> {
        self.copies.dequeue()
    }
}

/// Whether rows of this many ticks take at most half of the line; the rest is for requests.
fn fits(every: u32, baud: u32) -> bool {
    let row = if every == 1 { ROW_OF_ONE } else { ROW };
    // In ns: twice the time of a row's bits, and the time of its ticks.
    let line = 2 * BITS * (row + FRAME) as u64 * 1_000_000_000;
    line <= u64::from(every) * u64::from(PERIOD_NANOSECONDS) * u64::from(baud)
}

/// The shortest rows of several ticks that fit, or of one if those fit.
fn least(baud: u32) -> u32 {
    let (mut low, mut high) = (0, MOST_EVERY);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if fits(middle, baud) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
