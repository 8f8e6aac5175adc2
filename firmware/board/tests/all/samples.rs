//! Samples of a board, through the frames of the link: what every tick showed, whatever happens to the line, and what is missing is seen.

use crate::board_support::{Line, done, refused, running};
use controller::Real;
use specgen_link::client::Client;
use specgen_link::samples::{MOST_EVERY, Row, Spread, rows};
use specgen_link::{Refusal, Reply, Request};
use specgen_runtime::Real as _;

/// Ticks of the shortest rows that fit on 921,600 baud at 10 kHz, half of the line left free.
const LEAST: u32 = 45;

struct Block {
    number: u32,
    tick: u64,
    every: u32,
    more: bool,
    rows: Vec<Row>,
}

fn take(client: &mut Client<Line>) -> Block {
    match client.ask(&Request::Samples).unwrap() {
        Reply::Samples { number, tick, every, more, rows: bytes } => {
            Block { number, tick, every, more, rows: rows(every, bytes.0).unwrap().collect() }
        }
        other => panic!("{other:?}"),
    }
}

/// All rows of the blocks against what the ticks showed; how many there were.
fn check(line: &Line, blocks: &[Block]) -> usize {
    let shown = line.with(|rig| rig.shown.clone().unwrap());
    let first = shown[0].0;
    for block in blocks {
        for (index, row) in block.rows.iter().enumerate() {
            let tick = block.tick + u64::from(block.every) * index as u64;
            let ticks = &shown[(tick - first) as usize..][..block.every as usize];
            assert_eq!(ticks[0].0, tick);
            let number = |place: &[u64], at: usize| Real::from_word(place[at]);
            let (_, _, phase, last) = &ticks[ticks.len() - 1];
            assert_eq!((row.phase, row.status), (*phase, ticks.iter().fold(0, |all, (_, status, ..)| all | status)));
            for axis in 0..6 {
                assert_eq!(row.pose[axis], number(last, axis) as f32);
                assert_eq!(row.target[axis], number(last, 6 + axis) as f32);
                let error = ticks.iter().map(|(.., place)| (number(place, 6 + axis) - number(place, axis)) as f32);
                spread(&row.error[axis], error.collect());
                spread(&row.volts[axis], ticks.iter().map(|(.., place)| number(place, 18 + axis) as f32).collect());
            }
        }
    }
    blocks.iter().map(|block| block.rows.len()).sum()
}

/// Least and most to the bit, the mean to two roundings of the largest value.
fn spread(found: &Spread, mut values: Vec<f32>) {
    let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64;
    values.sort_by(f32::total_cmp);
    let (least, most) = (values[0], values[values.len() - 1]);
    let largest = f64::from(if least.abs() > most.abs() { least.abs() } else { most.abs() });
    assert_eq!((found.least, found.most), (least, most));
    assert!((f64::from(found.mean) - mean).abs() <= 2.0 * f64::from(f32::EPSILON) * largest, "{found:?} {mean}");
}

#[test]
fn a_board_shows_every_tick_and_what_it_could_not() {
    let line = Line::new(4000);
    let mut client = line.client(1);
    running(&line, &mut client);
    assert!(take(&mut client).rows.is_empty(), "nobody looks on");
    for (every, refusal) in [
        (1, Refusal::Rate { least: LEAST }),
        (LEAST - 1, Refusal::Rate { least: LEAST }),
        (MOST_EVERY + 1, Refusal::Word { index: 0 }),
    ] {
        assert_eq!(refused(&mut client, &Request::Stream { every }), refusal);
    }
    line.with(|rig| assert!(rig.exchange.report.health.gauge_faults <= 1));
    for every in [MOST_EVERY, 0] {
        done(&mut client, &Request::Stream { every });
    }
    line.with(|rig| (rig.shown, rig.pace) = (Some(Vec::new()), 9));
    done(&mut client, &Request::Stream { every: LEAST });

    // Over a line that spoils one byte in a thousand, nothing is lost.
    line.with(|rig| rig.spoilt = 1);
    let blocks: Vec<Block> = (0..900).map(|_| take(&mut client)).filter(|block| !block.rows.is_empty()).collect();
    line.with(|rig| rig.spoilt = 0);
    assert!(blocks.iter().all(|block| block.every == LEAST) && check(&line, &blocks) > 100);
    for pair in blocks.windows(2) {
        let end = pair[0].tick + u64::from(LEAST) * pair[0].rows.len() as u64;
        assert_eq!((pair[1].number, pair[1].tick), (pair[0].number + 1, end));
    }

    // A host that does not ask for a while: two blocks of five rows wait for it, and the numbers say what was given up.
    while take(&mut client).more {}
    line.tick(10 * 5 * LEAST);
    let late: Vec<Block> = (0..2).map(|_| take(&mut client)).collect();
    assert!(late[0].number >= blocks[blocks.len() - 1].number + 8 && late[0].more, "{}", late[0].number);
    assert!(!late[1].more, "the second is the last");
    assert_eq!(check(&line, &late), 10);

    // A background without time: 32 ticks wait for it, the others are missing between two blocks, and no row is of less than it says.
    line.with(|rig| rig.busy = true);
    line.tick(500);
    line.with(|rig| rig.busy = false);
    line.tick(2 * LEAST);
    let blocks: Vec<Block> = (0..8).map(|_| take(&mut client)).filter(|block| !block.rows.is_empty()).collect();
    check(&line, &blocks);
    let gaps = blocks
        .windows(2)
        .map(|pair| pair[1].tick - (pair[0].tick + u64::from(pair[0].every) * pair[0].rows.len() as u64));
    // The tick that ends it finds the ring full, too.
    assert_eq!(gaps.filter(|gap| *gap > 0).collect::<Vec<_>>(), [501 - 32]);
    assert!(blocks.iter().any(|block| block.every != LEAST && block.rows.len() == 1));

    // Another host begins without.
    let mut client = line.client(2);
    line.tick(5 * LEAST);
    assert!(take(&mut client).rows.is_empty());
}
