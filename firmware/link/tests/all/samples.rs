//! Samples: rows are what an independent computation says of the ticks, and whatever is missing is seen.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_link::samples::{AXES, BLOCK, Block, Collector, MOST_EVERY, ROW, ROW_OF_ONE, Row, Sample, Spread, rows};
use specgen_link::{Bytes, Device, Endpoint, Kind, MESSAGE, Receiver, Reply, Request};

use crate::support::{IDENTITY, session};

/// Ticks as a machine might show them, of six decades.
fn ticks(count: u64, seed: u64) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut six = |size: f32, offset: f32| [(); AXES].map(|()| offset + size * (random.next_u32() as i32 as f32 / 2e9));
    (0..count)
        .map(|tick| {
            let (pose, error, volts) = (six(5e-5, 0.0), six(1e-9, 3e-10), six(1e-3, 71.0));
            let target = core::array::from_fn(|axis| pose[axis] + error[axis]);
            Sample { tick, status: 1 << (tick % 20), phase: (tick % 6) as u8, pose, target, error, volts }
        })
        .collect()
}

fn collector(blocks: usize, every: u32) -> Collector<Vec<Block>> {
    let mut collector = Collector::new(vec![Block::EMPTY; blocks]);
    collector.start(every);
    collector
}

/// All that waits whole.
fn take(collector: &mut Collector<Vec<Block>>) -> Vec<Block> {
    (0..collector.waiting()).map(|_| *collector.take().unwrap()).collect()
}

fn read(block: &Block) -> Vec<Row> {
    rows(block.every, block.bytes()).unwrap().collect()
}

/// Least, mean and most of a value: the mean in 64 bits.
fn spread(ticks: &[Sample], value: impl Fn(&Sample) -> f32) -> (f32, f64, f32) {
    let mut values: Vec<f32> = ticks.iter().map(value).collect();
    let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64;
    values.sort_by(f32::total_cmp);
    (values[0], mean, values[values.len() - 1])
}

/// Least and most to the bit, the mean to two roundings of the largest value.
fn check(found: &Spread, ticks: &[Sample], value: impl Fn(&Sample) -> f32 + Copy) {
    let (least, mean, most) = spread(ticks, value);
    assert_eq!((found.least.to_bits(), found.most.to_bits()), (least.to_bits(), most.to_bits()));
    let largest = ticks.iter().map(|tick| value(tick).abs()).fold(0.0, |a: f32, b| if b > a { b } else { a });
    let off = (f64::from(found.mean) - mean).abs();
    assert!(off <= 2.0 * f64::from(f32::EPSILON) * f64::from(largest), "{found:?}: {mean}, off by {off}");
}

#[test]
fn rows_are_what_the_ticks_say() {
    for every in [1, 2, 7, 100, 5000] {
        let ticks = ticks(u64::from(every) * 45, u64::from(every));
        let mut collector = collector(64, every);
        ticks.iter().for_each(|tick| collector.add(tick));
        let blocks = take(&mut collector);
        let found: Vec<Row> = blocks.iter().flat_map(read).collect();
        assert_eq!(found.len(), 45, "{every}");
        for (row, ticks) in found.iter().zip(ticks.chunks(every as usize)) {
            let last = &ticks[ticks.len() - 1];
            assert_eq!((row.phase, row.pose, row.target), (last.phase, last.pose, last.target));
            assert_eq!(row.status, ticks.iter().fold(0, |all, tick| all | tick.status));
            for axis in 0..AXES {
                check(&row.error[axis], ticks, |tick| tick.error[axis]);
                check(&row.volts[axis], ticks, |tick| tick.volts[axis]);
            }
        }
        let mut next = 0;
        for (number, block) in blocks.iter().enumerate() {
            assert_eq!((block.number as usize, block.tick, block.every), (number, next, every));
            next += u64::from(every) * read(block).len() as u64;
        }
    }
}

#[test]
fn a_million_ticks_have_the_mean_of_one_and_its_neighbours() {
    // Where every addition rounds: without what it loses carried along the mean would be 1.
    let mut collector = collector(2, MOST_EVERY);
    let tick = Sample { error: [1.0 + f32::EPSILON; AXES], ..ticks(1, 0)[0] };
    for number in 0..u64::from(MOST_EVERY) {
        collector.add(&Sample { tick: number, ..tick });
    }
    let row = read(collector.take().unwrap())[0];
    assert_eq!(row.error[0], Spread { least: 1.0 + f32::EPSILON, mean: 1.0 + f32::EPSILON, most: 1.0 + f32::EPSILON });
}

#[test]
fn what_is_not_fetched_is_a_gap_in_the_numbers() {
    let ticks = ticks(400, 3);
    let mut collector = collector(4, 1);
    let most = BLOCK / ROW_OF_ONE;
    ticks[..20 * most].iter().for_each(|tick| collector.add(tick));
    // Three of twenty wait; the newest are there.
    let blocks = take(&mut collector);
    assert_eq!(blocks.iter().map(|block| block.number).collect::<Vec<_>>(), [17, 18, 19]);
    for (block, ticks) in blocks.iter().zip(ticks[17 * most..].chunks(most)) {
        assert_eq!(block.tick, ticks[0].tick);
        assert!(read(block).iter().zip(ticks).all(|(row, tick)| row.pose == tick.pose));
    }
    assert!(collector.take().is_none());
    // A look at what is not whole.
    ticks[20 * most..20 * most + 2].iter().for_each(|tick| collector.add(tick));
    let block = *collector.take().unwrap();
    assert_eq!((block.number, block.tick, read(&block).len()), (20, 20 * most as u64, 2));
    assert!(collector.take().is_none());
}

#[test]
fn ticks_that_never_came_end_row_and_block_and_nothing_seen_is_left_out() {
    let ticks = ticks(100, 4);
    let mut collector = collector(16, 10);
    // 0 to 24, 30 to 49, 75.
    let seen = ticks[..25].iter().chain(&ticks[30..50]).chain(&ticks[75..76]);
    seen.for_each(|tick| collector.add(tick));
    let blocks = take(&mut collector);
    let shape: Vec<_> = blocks.iter().map(|block| (block.number, block.tick, block.every, read(block).len())).collect();
    assert_eq!(shape, [(0, 0, 10, 2), (1, 20, 5, 1), (2, 30, 10, 2)]);
    check(&read(&blocks[1])[0].volts[2], &ticks[20..25], |tick| tick.volts[2]);
    // The tick behind the last gap is not a row yet.
    assert!(collector.take().is_none());
    // A stream that begins anew forgets it, and what waits.
    collector.start(1);
    collector.add(&ticks[99]);
    let block = *collector.take().unwrap();
    assert_eq!((block.number, block.tick, read(&block).len()), (0, 99, 1));
    collector.start(0);
    collector.add(&ticks[99]);
    assert!(collector.take().is_none() && collector.every() == 0);
}

#[test]
fn memory_of_no_block_takes_everything_and_gives_nothing() {
    let mut collector = collector(0, 1);
    ticks(50, 5).iter().for_each(|tick| collector.add(tick));
    assert!(collector.take().is_none());
}

/// Answers with the largest block that there can be.
struct Shows(Block);

impl Device for Shows {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        match request {
            Request::Hello => Reply::Identity(IDENTITY),
            Request::Samples => Reply::Samples {
                number: u32::MAX,
                tick: u64::MAX,
                every: MOST_EVERY,
                more: true,
                rows: Bytes(self.0.bytes()),
            },
            _ => Reply::Done,
        }
    }
}

#[test]
fn the_largest_block_fits_into_a_message_and_no_flipped_bit_of_it_is_believed() {
    let mut full = collector(2, MOST_EVERY);
    let sample = ticks(1, 6)[0];
    for number in 0..5 * u64::from(MOST_EVERY) {
        full.add(&Sample { tick: number, ..sample });
    }
    let block = *full.take().unwrap();
    assert_eq!(block.bytes().len(), 5 * ROW);
    let (mut endpoint, mut device) = (Endpoint::new(), Shows(block));
    let mut answers = Vec::new();
    for byte in session(&[Request::Stream { every: 1 }, Request::Samples]).concat() {
        answers.extend(endpoint.push(byte, &mut device).map(<[u8]>::to_vec));
    }
    let frame = answers.pop().unwrap();
    assert!(frame.len() > MESSAGE - 16, "{}: refused as too long?", frame.len());
    let mut passed = 0;
    for bit in 0..8 * frame.len() {
        let mut damaged = frame.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let mut receiver = Receiver::new();
        passed += damaged.iter().filter(|byte| matches!(receiver.push(**byte), Some(Ok(_)))).count();
    }
    assert_eq!(passed, 0);
    let mut receiver = Receiver::new();
    let whole =
        frame.iter().any(|byte| matches!(receiver.push(*byte), Some(Ok((header, _))) if header.kind == Kind::Reply));
    assert!(whole);
}

#[test]
fn bytes_that_are_no_rows_are_refused_whatever_they_are() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut bytes = [0; BLOCK];
    for _ in 0..2000 {
        random.fill_bytes(&mut bytes);
        let (length, every) = (random.next_u32() as usize % BLOCK, random.next_u32() >> (random.next_u32() % 32));
        let row = if every == 1 { ROW_OF_ONE } else { ROW };
        let found = rows(every, &bytes[..length]).map(Iterator::count);
        assert_eq!(found, (length % row == 0).then_some(length / row));
    }
}
