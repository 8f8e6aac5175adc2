//! Ticks for subscribed hosts, each with its own row length. The service makes them from the loop's rows; the loop is
//! not involved.

use controller::Real;
use controller::snapshot::recorder;
use specgen_link::samples::{AXES, Block, Collector, MOST_EVERY, Sample};
use specgen_link::{Refusal, Reply};
use specgen_runtime::Real as _;

use crate::handover::Row;

/// Blocks that wait for a host: 0.9 s at 10 kHz, tick by tick.
const BLOCKS: usize = 1024;

/// Stream of a subscribed host; nothing until its first request.
#[derive(Default)]
pub struct Stream(Option<Collector<Vec<Block>>>);

impl Stream {
    /// Starts rows of `every` ticks; 0 stops them.
    ///
    /// # Errors
    /// If a row is too long.
    pub fn start(&mut self, every: u32) -> Result<(), Refusal> {
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

    /// Takes the results of a tick.
    pub fn add(&mut self, row: &Row) {
        if let Some(collector) = &mut self.0 {
            collector.add(&sample(row));
        }
    }

    /// The oldest block.
    pub fn take(&mut self) -> Reply<'_> {
        let more = self.0.as_ref().is_some_and(|collector| collector.waiting() > 1);
        let block = self.0.as_mut().and_then(Collector::take).unwrap_or(&Block::EMPTY);
        block.reply(more)
    }
}

fn sample(row: &Row) -> Sample {
    let six = |first: usize| -> [Real; AXES] {
        core::array::from_fn(|axis| row.place.get(first + axis).map_or(0.0, |word| Real::from_word(*word)))
    };
    let recorder::Row { status, supervisor, .. } = row.output;
    specgen_board::sample(row.tick, status, supervisor as u8, [six(AXES), six(0)], six(3 * AXES))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::row;
    use specgen_link::Bytes;
    use specgen_link::samples::rows;

    fn shown(tick: u64) -> Row {
        let mut row = row(tick);
        row.place = core::array::from_fn(|k| crate::words::word(tick as Real + k as Real / 32.0));
        row.output.supervisor = 0x10302;
        row.output.status = 9;
        row
    }

    #[test]
    fn a_row_shows_pose_target_error_and_volts_of_its_axes() {
        let Sample { tick, status, phase, pose, target, error, volts } = sample(&shown(4));
        assert_eq!((tick, status, phase), (4, 9, 2));
        let of = |first: usize| -> [f32; AXES] { core::array::from_fn(|axis| 4.0 + (first + axis) as f32 / 32.0) };
        assert_eq!((pose, target, volts), (of(0), of(6), of(18)));
        assert_eq!(error, [6.0 / 32.0; AXES]);
    }

    #[test]
    fn rows_begin_when_they_are_asked_for_and_come_in_blocks() {
        let mut stream = Stream::default();
        stream.add(&shown(0));
        let none = Reply::Samples { number: 0, tick: 0, every: 0, more: false, rows: Bytes(&[]) };
        assert_eq!(stream.take(), none);
        assert_eq!(stream.start(MOST_EVERY + 1), Err(Refusal::Word { index: 0 }));
        assert_eq!(stream.start(MOST_EVERY), Ok(()));
        assert_eq!(stream.start(1), Ok(()));
        for tick in 1..=100 {
            stream.add(&shown(tick));
        }
        // All of them, in blocks; all but the last two report that another complete block waits.
        let (mut next, mut flags) = (1, Vec::new());
        while next <= 100 {
            let Reply::Samples { number, tick, every: 1, more, rows: bytes } = stream.take() else { panic!("samples") };
            assert_eq!((number as usize, tick), (flags.len(), next));
            next += rows(1, bytes.0).unwrap().len() as u64;
            flags.push(more);
        }
        // Behind the last but one there is only what is being filled.
        let others = flags.len() - 2;
        assert!(next == 101 && others > 0, "{flags:?}");
        assert_eq!(flags, [vec![true; others], vec![false; 2]].concat());
        stream.add(&shown(101));
        assert_eq!(stream.start(0), Ok(()));
        assert_eq!(stream.take(), none);
    }
}
