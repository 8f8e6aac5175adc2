use super::*;
use crate::description::tests::six_legs;
use crate::word::Scalar;
use specgen_runtime::record::Layout;
use specgen_runtime::recorder::{Activity, MemoryError, Recorder, Row as Out, Settings, Trigger};

const LAYOUT: Layout = Layout { config: 3, input: 14, state: 5 };

/// A machine that counts: its state is the tick, its digest follows from it, its output from the input.
fn input(tick: u64) -> Vec<u64> {
    (0..14).map(|k| if k % 3 == 0 { tick / 4 } else { k * (tick % 2) }).collect()
}

fn out(tick: u64, phase: u32) -> Out {
    let code = tick as i32;
    Out { codes: [code, -code, 3, 4, 5, code * 2], status: 7 * tick as u32, supervisor: phase | 3 << 8 | 1 << 16 }
}

/// Ticks `from..to` through a recorder, in phase `phase` of each.
fn ticks(recorder: &mut Recorder<'_>, range: std::ops::Range<u64>, phase: impl Fn(u64) -> u32) {
    for tick in range {
        if recorder.opens() {
            recorder.open(&[1, 2, 3], tick ^ 0xd1, |words| words.fill(tick));
        }
        recorder.push(&input(tick), &out(tick, phase(tick)), || (tick + 1) ^ 0xd1);
    }
}

fn bytes(recorder: &Recorder<'_>) -> Vec<u8> {
    let text = six_legs(Scalar::F64).to_text() + "period=0.001\n";
    let mut writer = Writer::new(Vec::new(), &text).unwrap();
    for index in 0..recorder.blocks() {
        writer.take(recorder.block(index).unwrap()).unwrap();
    }
    writer.finish().unwrap()
}

fn pieces(bytes: &[u8]) -> Vec<FileItem> {
    let mut reader = Reader::new(bytes).unwrap();
    std::iter::from_fn(|| reader.next_piece().unwrap()).collect()
}

fn whole(bytes: &[u8]) -> Vec<Block> {
    let block = |piece| match piece {
        FileItem::Block(block) => block,
        other => panic!("{other:?}"),
    };
    pieces(bytes).into_iter().map(block).collect()
}

/// Every row is that of its tick, and each block begins with the state before it.
fn is_right(blocks: &[Block], phase: impl Fn(u64) -> u32, every: u64) {
    for block in blocks {
        assert_eq!((block.state.clone(), block.config.clone()), (vec![block.first; 5], vec![1, 2, 3]));
        assert_eq!(block.digest, block.first ^ 0xd1);
        for (index, row) in block.rows.iter().enumerate() {
            let tick = block.first + index as u64 * every;
            let out = out(tick, phase(tick));
            assert_eq!((row.tick, &row.input), (tick, &input(tick)));
            assert_eq!((row.codes, row.status, row.supervisor), (out.codes, out.status, out.supervisor));
            assert!(row.digest.is_none_or(|digest| digest == (tick + 1) ^ 0xd1));
        }
    }
}

#[test]
fn a_trigger_keeps_what_was_before_it_and_so_many_rows_after() {
    let phase = |tick: u64| if tick < 700 { 2 } else { 5 };
    for (trigger, expected) in [
        (Trigger { fault: true, phase_change: false }, Some(700)),
        (Trigger { fault: false, phase_change: true }, Some(700)),
        (Trigger::default(), None),
    ] {
        let mut memory = vec![0; 4 * 400];
        let mut recorder = Recorder::new(&mut memory, 4, LAYOUT).unwrap();
        let settings = Settings { streaming: false, trigger, after: 30, decimation: 1, digest_every: 10 };
        recorder.start(settings);
        ticks(&mut recorder, 0..2000, phase);
        if expected.is_none() {
            assert_eq!(recorder.activity(), Activity::Waiting);
            recorder.trigger();
            ticks(&mut recorder, 2000..2100, phase);
        }
        let at = expected.unwrap_or(2000);
        assert_eq!((recorder.activity(), recorder.lost()), (Activity::Complete, 0));
        let blocks = whole(&bytes(&recorder));
        is_right(&blocks, phase, 1);
        assert_eq!(blocks.iter().filter_map(|block| block.trigger).collect::<Vec<_>>(), [at]);
        assert_eq!(blocks.last().unwrap().rows.last().unwrap().tick, at + 29);
        // Without a gap, and well before the trigger.
        assert!(blocks.windows(2).all(|pair| pair[0].first + pair[0].rows.len() as u64 == pair[1].first));
        assert!(blocks.len() >= 3 && blocks[0].first < at - 30, "{} blocks from {}", blocks.len(), blocks[0].first);
        let digests: Vec<u64> = blocks
            .iter()
            .flat_map(|block| &block.rows)
            .filter(|row| row.digest.is_some())
            .map(|row| row.tick)
            .collect();
        assert!(digests.len() > 5 && digests.windows(2).all(|pair| pair[1] - pair[0] <= 10), "{digests:?}");
    }
}

#[test]
fn a_stream_hands_out_every_row_and_counts_what_nobody_fetched() {
    let mut memory = vec![0; 3 * 300];
    let mut recorder = Recorder::new(&mut memory, 3, LAYOUT).unwrap();
    recorder.start(Settings::STREAM);
    let text = six_legs(Scalar::F64).to_text() + "period=0.001\n";
    let mut writer = Writer::new(Vec::new(), &text).unwrap();
    for tick in 0..500 {
        ticks(&mut recorder, tick..tick + 1, |_| 2);
        if tick == 250 {
            recorder.settings_changed();
        }
        writer.drain(&mut recorder).unwrap();
    }
    recorder.stop();
    writer.drain(&mut recorder).unwrap();
    let blocks = whole(&writer.finish().unwrap());
    is_right(&blocks, |_| 2, 1);
    assert_eq!(blocks.iter().map(|block| block.rows.len()).sum::<usize>(), 500);
    let settings: Vec<u64> =
        blocks.iter().filter(|block| block.reason == Reason::Settings).map(|block| block.first).collect();
    assert_eq!((settings, blocks[0].reason, recorder.lost()), (vec![251], Reason::Started, 0));

    recorder.start(Settings::STREAM);
    ticks(&mut recorder, 500..1500, |_| 2);
    recorder.stop();
    assert!(recorder.lost() > 10, "{}", recorder.lost());
    let blocks = whole(&bytes(&recorder));
    is_right(&blocks, |_| 2, 1);
    assert_eq!((blocks.len(), blocks[2].rows.last().unwrap().tick), (3, 1499));
}

#[test]
fn one_row_in_some_shows_more_time() {
    let mut memory = vec![0; 2 * 400];
    let mut recorder = Recorder::new(&mut memory, 2, LAYOUT).unwrap();
    recorder.start(Settings { decimation: 7, ..Settings::STREAM });
    ticks(&mut recorder, 0..100, |_| 2);
    recorder.stop();
    let blocks = whole(&bytes(&recorder));
    is_right(&blocks, |_| 2, 7);
    assert_eq!(blocks.iter().flat_map(|block| &block.rows).last().unwrap().tick, 98);
    assert_eq!(blocks[0].decimation, 7);
}

#[test]
fn a_memory_that_is_too_small_is_refused_with_what_is_needed() {
    let needed = LAYOUT.preamble() + LAYOUT.longest_row();
    for (size, blocks, layout, expected) in [
        (2 * needed - 1, 2, LAYOUT, MemoryError::TooSmall(2 * needed)),
        (100_000, 1, LAYOUT, MemoryError::TooSmall(2 * needed)),
        (100_000, 0, LAYOUT, MemoryError::TooSmall(2 * needed)),
        (100_000, 2, Layout { input: 61, ..LAYOUT }, MemoryError::InputTooLong),
    ] {
        let mut memory = vec![0; size];
        assert_eq!(Recorder::new(&mut memory, blocks, layout).err(), Some(expected));
    }
    let mut memory = vec![0; 2 * needed];
    let mut recorder = Recorder::new(&mut memory, 2, LAYOUT).unwrap();
    recorder.start(Settings::STREAM);
    ticks(&mut recorder, 0..3, |_| 2);
    recorder.stop();
    let blocks = whole(&bytes(&recorder));
    is_right(&blocks, |_| 2, 1);
}

/// Any byte of a file, changed to any value: an error, never accepted, never a crash.
#[test]
fn a_changed_byte_is_always_reported() {
    let mut memory = vec![0; 4 * 200];
    let mut recorder = Recorder::new(&mut memory, 4, LAYOUT).unwrap();
    recorder.start(Settings::STREAM);
    ticks(&mut recorder, 0..15, |_| 2);
    recorder.stop();
    let good = bytes(&recorder);
    let expected = pieces(&good);
    assert!(expected.len() >= 2);
    let mut read = 0;
    for place in 0..good.len() {
        for change in [0x01, 0x80, 0xff] {
            let mut bytes = good.clone();
            bytes[place] ^= change;
            let Ok(mut reader) = Reader::new(&bytes[..]) else { continue };
            read += 1;
            let found: Vec<FileItem> = std::iter::from_fn(|| reader.next_piece().unwrap()).collect();
            assert!(found.iter().any(|piece| !matches!(piece, FileItem::Block(_))), "byte {place}");
            for piece in &found {
                assert!(!matches!(piece, FileItem::Block(_)) || expected.contains(piece), "byte {place}");
            }
        }
    }
    // What spoils the head is refused as a whole.
    assert!(read > good.len(), "{read} of {} were read", 3 * good.len());
    let mut cut = 0;
    for length in 0..good.len() {
        if let Ok(mut reader) = Reader::new(&good[..length]) {
            while let Some(piece) = reader.next_piece().unwrap() {
                assert!(expected.contains(&piece) || matches!(piece, FileItem::Cut { .. }), "{length} bytes");
                cut += usize::from(matches!(piece, FileItem::Cut { .. }));
            }
        }
    }
    assert!(cut > good.len() / 4, "{cut}");
}
