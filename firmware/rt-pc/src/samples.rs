//! Ticks for hosts that look on, each in rows as it wants them. Made by the service of the rows that it is handed anyway: the loop
//! knows nothing of it.

use controller::{PLACE_WORDS, Real};
use specgen_link::samples::{AXES, Block, Collector, MOST_EVERY, Sample};
use specgen_link::{Bytes, Refusal, Reply};
use specgen_runtime::Real as _;

use crate::handover::Row;

/// Blocks that wait for a host: 0.9 s at 10 kHz, tick by tick.
const BLOCKS: usize = 1024;
/// Whether there is a pose: six legs have none.
const POSSIBLE: bool = PLACE_WORDS >= 4 * AXES;

/// What a host looks on with; nothing until it first asks for it.
#[derive(Default)]
pub struct Stream(Option<Collector<Vec<Block>>>);

impl Stream {
    /// Rows of `every` ticks from here on, none with 0.
    ///
    /// # Errors
    /// There is no pose; a row is too long.
    pub fn start(&mut self, every: u32) -> Result<(), Refusal> {
        if !POSSIBLE {
            return Err(Refusal::Unsupported);
        }
        if every > MOST_EVERY {
            return Err(Refusal::Word { index: 0 });
        }
        if every == 0 {
            self.0 = None;
        } else {
            self.0.get_or_insert_with(|| Collector::new(vec![Block::EMPTY; BLOCKS])).start(every);
        }
        Ok(())
    }

    /// Takes what a tick showed.
    pub fn add(&mut self, row: &Row) {
        if let Some(collector) = &mut self.0 {
            collector.add(&sample(row));
        }
    }

    /// The oldest block.
    pub fn take(&mut self) -> Reply<'_> {
        let more = self.0.as_ref().is_some_and(|collector| collector.waiting() > 1);
        let block = self.0.as_mut().and_then(Collector::take).unwrap_or(&Block::EMPTY);
        let Block { number, tick, every, .. } = *block;
        Reply::Samples { number, tick, every, more, rows: Bytes(block.bytes()) }
    }
}

fn sample(row: &Row) -> Sample {
    let six = |first: usize| -> [Real; AXES] {
        core::array::from_fn(|axis| row.place.get(first + axis).map_or(0.0, |word| Real::from_word(*word)))
    };
    let rounded = |values: [Real; AXES]| values.map(|value| value as f32);
    let (pose, target) = (six(0), six(AXES));
    Sample {
        tick: row.tick,
        status: row.output.status,
        phase: row.output.supervisor as u8,
        pose: rounded(pose),
        target: rounded(target),
        error: rounded(core::array::from_fn(|axis| target[axis] - pose[axis])),
        volts: rounded(six(3 * AXES)),
    }
}
