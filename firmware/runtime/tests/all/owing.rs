//! A recorder that owes snapshots and digests, beside one that is given them at once.

use specgen_runtime::record::{HAS_DIGEST, Layout, Reason};
use specgen_runtime::recorder::{Recorder, Row, Settings, SnapshotPurpose, Trigger};

use crate::common::Random;

const LAYOUT: Layout = Layout { config: 3, input: 2, state: 5 };
const SIZE: usize = 8 + 3 + 5 + 160;
const BLOCKS: usize = 3;
/// Pieces in which a preamble is handed in.
const PIECE: usize = 3;

fn settings(digest_every: u32) -> Settings {
    let trigger = Trigger { fault: false, phase_change: false };
    Settings { streaming: false, trigger, after: 9, decimation: 1, digest_every }
}

/// The machine at a tick: settings, state, digest.
fn machine(tick: u64) -> ([u64; 8], u64) {
    (core::array::from_fn(|k| tick << 8 | k as u64), !tick)
}

fn row(tick: u64) -> Row {
    Row { codes: [tick as i32; 6], status: 7, supervisor: 0x1_0003 }
}

/// What a background does with what is owed.
#[derive(Default)]
struct Background {
    /// The machine that it was left with, and words that are handed in.
    left: Option<(u64, usize)>,
}

impl Background {
    /// Keeps the machine, hands in a piece, or settles.
    fn works(&mut self, recorder: &mut Recorder<'_>) {
        if let Some(want) = recorder.wants() {
            assert!(self.left.replace((recorder.tick(), 0)).is_none());
            recorder.owe(want);
        }
        let Some((tick, first)) = self.left else { return };
        let (words, digest) = machine(tick);
        if recorder.owes_block() && first < words.len() {
            let piece = &words[first..(first + PIECE).min(words.len())];
            recorder.hand_in(first, piece);
            self.left = Some((tick, first + piece.len()));
        } else {
            recorder.settle(digest);
            self.left = None;
        }
    }
}

#[test]
fn what_is_handed_in_before_the_next_tick_is_what_another_has_at_once() {
    let (mut one, mut other) = ([u64::MAX; SIZE * BLOCKS], [u64::MAX; SIZE * BLOCKS]);
    let mut random = Random(5);
    let mut found = Recorder::new(&mut one, BLOCKS, LAYOUT).unwrap().owing();
    let mut plain = Recorder::new(&mut other, BLOCKS, LAYOUT).unwrap();
    let mut background = Background::default();
    for recorder in [&mut found, &mut plain] {
        recorder.start(settings(0));
    }
    for k in 0..500 {
        let changes = k % 97 == 50;
        let input = [random.next() % 3, random.next() % 2];
        // The first row has no block yet.
        let after = plain.tick() + 1;
        found.push(&input, &row(after), || unreachable!("they are the background's"));
        if changes {
            found.settings_changed();
        }
        plain.push(&input, &row(after), || unreachable!("no digests"));
        if changes {
            plain.settings_changed();
        }
        // As early as the other one, that is before it is full.
        if plain.opens() || found.wants() == Some(SnapshotPurpose::Block) {
            let (words, digest) = machine(after);
            plain.open(&words[..3], digest, |state| state.copy_from_slice(&words[3..]));
        }
        while found.owes() || found.wants().is_some() {
            background.works(&mut found);
        }
        assert_eq!((found.blocks(), found.rows()), (plain.blocks(), plain.rows()));
        for block in 0..plain.blocks() {
            assert_eq!(found.block(block), plain.block(block), "tick {k}, block {block}");
        }
    }
    assert_eq!(plain.blocks(), BLOCKS - 1);
}

/// Whatever comes between, no row is in a block that it does not continue, and no word is left out.
#[test]
fn blocks_are_whole_however_late_the_background_is() {
    let mut random = Random(11);
    let (mut checked, mut cut, mut digests) = (0, 0, 0);
    for round in 0..60 {
        let mut memory = [u64::MAX; SIZE * BLOCKS];
        let mut recorder = Recorder::new(&mut memory, BLOCKS, LAYOUT).unwrap().owing();
        let mut background = Background::default();
        recorder.start(settings(1 + round % 4));
        for _ in 0..200 + random.below(200) {
            match random.below(40) {
                0 => recorder.settings_changed(),
                1 => recorder.restarted(),
                2 if round % 3 == 0 => recorder.start(settings(3)),
                _ => {}
            }
            let after = recorder.tick() + 1;
            recorder.push(&[random.next() % 3, 0], &row(after), || unreachable!("they are the background's"));
            if random.below(40) == 0 {
                recorder.settings_changed();
            }
            for _ in 0..random.below(1 + round as usize % 5) {
                background.works(&mut recorder);
            }
        }
        recorder.stop();
        while recorder.owes() {
            background.works(&mut recorder);
        }
        let mut next = None;
        for index in 0..recorder.blocks() {
            let block = recorder.block(index).unwrap();
            let ([words, rows, first, reason, digest], begin) = (core::array::from_fn(|k| block[k + 1]), block[3]);
            assert_eq!(
                (words as usize, digest, block[8..16].to_vec()),
                (block.len(), !first, machine(first).0.to_vec())
            );
            let continues = reason as u32 != Reason::Started.word() as u32;
            assert!(!continues || next.is_none_or(|next| next == begin), "{next:?}, {begin}");
            cut += usize::from(next.is_some_and(|next| next != begin));
            let mut rest = &block[16..];
            for row in 0..rows {
                let inputs = (rest[0] & !HAS_DIGEST).count_ones() as usize;
                assert_eq!(rest[inputs + 1] as u32, (begin + row + 1) as u32, "codes of a row");
                let has_digest = rest[0] & HAS_DIGEST != 0;
                if has_digest {
                    assert_eq!(rest[inputs + 5], !(begin + row + 1));
                    digests += 1;
                }
                rest = &rest[inputs + 5 + usize::from(has_digest)..];
            }
            assert!(rest.is_empty());
            next = Some(begin + rows);
            checked += 1;
        }
    }
    assert!(checked > 100 && cut > 5 && digests > 100, "{checked} blocks, {cut} gaps, {digests} digests");
}
