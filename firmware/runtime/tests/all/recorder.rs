//! The recorder against one that keeps lists, under calls in any order; and the format by its documentation.

use std::collections::VecDeque;

use specgen_runtime::Crc32;
use specgen_runtime::record::{
    BLOCK_MAGIC, FILE_MAGIC, FORMAT, LARGEST_INPUT, Layout, NO_TRIGGER, Reason, checksum, write_block, write_header,
};
use specgen_runtime::recorder::{Activity, MemoryError, Recorder, Row, Settings, Trigger};

use crate::common::Random;

const LAYOUT: Layout = Layout { config: 3, input: 5, state: 4 };
/// Header, settings, state; which inputs, inputs, four words out, a digest.
const PREAMBLE: usize = 8 + 3 + 4;
const LONGEST_ROW: usize = 1 + 5 + 4 + 1;
const FAULTED: u32 = 5;

/// Blocks as lists of words.
struct Plain {
    size: usize,
    most: usize,
    settings: Settings,
    activity: Activity,
    tick: u64,
    skip: u32,
    digest_in: u32,
    due: Option<Reason>,
    asked: bool,
    phase: u32,
    last: Vec<u64>,
    digest: Option<u64>,
    closed: VecDeque<Vec<u64>>,
    open: Option<Vec<u64>>,
    lost: u32,
}

impl Plain {
    fn new(size: usize, most: usize) -> Self {
        Self {
            size,
            most,
            settings: Settings::STREAM,
            activity: Activity::Stopped,
            tick: 0,
            skip: 0,
            digest_in: 0,
            due: None,
            asked: false,
            phase: 0,
            last: Vec::new(),
            digest: None,
            closed: VecDeque::new(),
            open: None,
            lost: 0,
        }
    }

    fn records(&self) -> bool {
        matches!(self.activity, Activity::Waiting | Activity::Triggered(_) | Activity::Streaming)
    }

    fn room_for(&self, rows: usize) -> bool {
        self.open.as_ref().is_some_and(|block| block.len() + rows * LONGEST_ROW <= self.size)
    }

    fn start(&mut self, settings: Settings) {
        let fresh = Self::new(self.size, self.most);
        let activity = if settings.streaming { Activity::Streaming } else { Activity::Waiting };
        let (tick, phase) = (self.tick, self.phase);
        *self = Self { settings, activity, tick, phase, due: Some(Reason::Started), ..fresh };
    }

    fn close(&mut self) {
        self.closed.extend(self.open.take().filter(|block| block[2] > 0));
    }

    fn opens(&self) -> bool {
        self.records() && self.skip == 0 && (self.due.is_some() || !self.room_for(1))
    }

    fn begins(&mut self, config: &[u64], digest: u64, state: &[u64]) {
        let reason = self.due.take().unwrap_or(Reason::Continued).word();
        self.close();
        if self.closed.len() == self.most {
            self.closed.pop_front();
            self.lost += u32::from(self.settings.streaming);
        }
        let digest = self.digest.take().unwrap_or(digest);
        let header = [
            BLOCK_MAGIC,
            PREAMBLE as u64,
            0,
            self.tick,
            reason + (u64::from(self.settings.decimation) << 32),
            digest,
            3 + (5 << 16) + (4 << 32),
            NO_TRIGGER,
        ];
        self.open = Some([&header, config, state].concat());
        self.last = vec![0; LAYOUT.input];
        if self.settings.digest_every > 1 {
            self.digest_in = self.settings.digest_every - 1;
        }
    }

    fn push(&mut self, input: &[u64], row: &Row, digest: u64) {
        let (tick, phase) = (self.tick, row.supervisor & 0xff);
        self.tick += 1;
        self.digest = None;
        if !self.records() {
            return;
        }
        let changed = phase != self.phase && tick > 0;
        self.phase = phase;
        let Trigger { fault, phase_change } = self.settings.trigger;
        let triggers = self.asked || changed && (phase_change || fault && phase == FAULTED);
        if self.activity == Activity::Waiting && triggers {
            self.asked = false;
            self.activity = Activity::Triggered(self.settings.after.max(1));
            self.open.iter_mut().for_each(|block| block[7] = tick);
        }
        if self.skip > 0 {
            self.skip -= 1;
            return;
        }
        self.skip = self.settings.decimation.max(1) - 1;
        self.write(input, row, digest);
        if let Activity::Triggered(left) = self.activity {
            self.activity = Activity::Triggered(left - 1);
            if left == 1 {
                self.activity = Activity::Complete;
                self.close();
            }
        }
    }

    fn write(&mut self, input: &[u64], row: &Row, digest: u64) {
        let every = self.settings.digest_every;
        let has_digest = every > 0 && (self.digest_in == 0 || !self.room_for(2));
        self.digest_in = if has_digest { every - 1 } else { self.digest_in.max(1) - 1 };
        if !self.room_for(1) {
            return;
        }
        let Some(block) = &mut self.open else { return };
        let differ: Vec<usize> = (0..LAYOUT.input).filter(|k| input[*k] != self.last[*k]).collect();
        self.last = input[..LAYOUT.input].to_vec();
        let which: u64 = differ.iter().map(|k| 1 << k).sum();
        block.push(which + (u64::from(has_digest) << 63));
        block.extend(differ.iter().map(|k| input[*k]));
        let pair = |a: u32, b: u32| u64::from(a) + (u64::from(b) << 32);
        block.extend(row.codes.chunks(2).map(|codes| pair(codes[0] as u32, codes[1] as u32)));
        block.push(pair(row.status, row.supervisor));
        if has_digest {
            block.push(digest);
            self.digest = Some(digest);
        }
        block[1] = block.len() as u64;
        block[2] += 1;
    }
}

fn same(found: &Recorder<'_>, plain: &Plain) {
    assert_eq!(found.activity(), plain.activity);
    assert_eq!((found.tick(), found.lost(), found.opens()), (plain.tick, plain.lost, plain.opens()));
    let rows: u64 = plain.closed.iter().chain(&plain.open).map(|block| block[2]).sum();
    assert_eq!((found.rows(), found.blocks()), (rows, plain.closed.len()));
    for (index, block) in plain.closed.iter().enumerate() {
        assert_eq!(found.block(index), Some(&block[..]), "block {index}");
    }
    assert_eq!(found.block(plain.closed.len()), None);
}

fn settings(random: &mut Random) -> Settings {
    let mut choose = |of: &[u32]| of[random.below(of.len())];
    Settings {
        streaming: choose(&[0, 0, 1]) == 1,
        trigger: Trigger { fault: choose(&[0, 1]) == 1, phase_change: choose(&[0, 0, 1]) == 1 },
        after: choose(&[0, 1, 2, 7, 40]),
        decimation: choose(&[0, 1, 1, 1, 2, 5]),
        digest_every: choose(&[0, 1, 2, 3, 10]),
    }
}

#[test]
fn blocks_and_rows_are_those_of_a_recorder_that_keeps_lists() {
    let mut random = Random(3);
    let mut ended = [0; 5];
    for round in 0..400 {
        let blocks = 2 + random.below(3);
        let size = PREAMBLE + LONGEST_ROW * (1 + random.below(5)) + random.below(LONGEST_ROW);
        let mut memory = vec![u64::MAX; blocks * size + random.below(blocks)];
        let mut found = Recorder::new(&mut memory, blocks, LAYOUT).unwrap();
        assert_eq!(found.capacity(), blocks * ((size - PREAMBLE) / LONGEST_ROW));
        let mut plain = Plain::new(size, blocks);
        let (mut config, mut input, mut phase) = ([1, 2, 3], [0_u64; 6], 0);
        for _ in 0..300 {
            match random.below(60) {
                0 => {
                    let settings = settings(&mut random);
                    found.start(settings);
                    plain.start(settings);
                }
                1 if round % 3 == 0 => {
                    found.stop();
                    plain.close();
                    if plain.activity != Activity::Complete {
                        plain.activity = Activity::Stopped;
                    }
                }
                2 => {
                    found.trigger();
                    plain.asked = true;
                }
                3 => {
                    found.restarted();
                    (plain.due, plain.digest) = (Some(Reason::Started), None);
                }
                4 | 5 => {
                    config[random.below(3)] = random.next();
                    found.settings_changed();
                    plain.due = plain.due.or(Some(Reason::Settings));
                }
                6 => {
                    let tick = plain.tick + random.below(2) as u64 * 5;
                    found.begin(tick);
                    if tick != plain.tick {
                        (plain.tick, plain.due, plain.digest) = (tick, Some(Reason::Started), None);
                    }
                    plain.due = plain.due.or(Some(Reason::Continued));
                }
                7..=9 => {
                    found.release();
                    plain.closed.pop_front();
                }
                10 => phase = random.below(6) as u32,
                _ => {}
            }
            same(&found, &plain);
            let state = [0; 4].map(|_| random.next());
            let digest = random.next();
            // Now and then nobody opens a block that is due: the rows are lost until someone does.
            if found.opens() && random.below(10) > 0 {
                if random.below(2) == 0 {
                    found.open(&config, digest, |words| words.copy_from_slice(&state));
                } else {
                    found.open_with(&config, || digest, |words| words.copy_from_slice(&state));
                }
                plain.begins(&config, digest, &state);
                same(&found, &plain);
            }
            for word in &mut input {
                if random.below(3) == 0 {
                    *word = random.next();
                }
            }
            let row = Row {
                codes: [0; 6].map(|_| random.next() as i32 - (1 << 30)),
                status: random.next() as u32,
                supervisor: phase | 0x1_0700,
            };
            let digest = random.next();
            found.push(&input, &row, || digest);
            plain.push(&input, &row, digest);
            same(&found, &plain);
            ended[match plain.activity {
                Activity::Stopped => 0,
                Activity::Waiting => 1,
                Activity::Triggered(_) => 2,
                Activity::Complete => 3,
                Activity::Streaming => 4,
            }] += 1;
        }
    }
    assert!(ended.iter().all(|count| *count > 1000), "{ended:?}");
}

#[test]
fn a_memory_that_is_too_small_is_refused_with_what_is_needed() {
    let least = PREAMBLE + LONGEST_ROW;
    assert_eq!((LAYOUT.preamble(), LAYOUT.longest_row()), (PREAMBLE, LONGEST_ROW));
    let refused =
        |words: usize, blocks: usize, layout: Layout| Recorder::new(&mut vec![0; words], blocks, layout).err();
    assert_eq!(refused(2 * least, 2, LAYOUT), None);
    assert_eq!(refused(2 * least - 1, 2, LAYOUT), Some(MemoryError::TooSmall(2 * least)));
    assert_eq!(refused(3 * least - 1, 3, LAYOUT), Some(MemoryError::TooSmall(3 * least)));
    for blocks in [0, 1] {
        assert_eq!(refused(1000, blocks, LAYOUT), Some(MemoryError::TooSmall(2 * least)));
    }
    let wide = |input| Layout { input, ..LAYOUT };
    assert_eq!(refused(1000, 2, wide(LARGEST_INPUT)), None);
    assert_eq!(refused(1000, 2, wide(LARGEST_INPUT + 1)), Some(MemoryError::InputTooLong));
}

/// CRC-32 of words in little-endian order.
fn crc(bytes: &[u8]) -> u64 {
    let mut crc = Crc32::new();
    crc.bytes(bytes);
    crc.finish().into()
}

fn gathered(write: impl FnOnce(&mut dyn FnMut(&[u8]) -> Result<(), ()>) -> Result<(), ()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut |piece| {
        bytes.extend(piece);
        Ok(())
    })
    .unwrap();
    bytes
}

#[test]
fn files_are_as_documented() {
    for length in 0..20 {
        let text = "k=value\nlonger=texts".get(..length).unwrap();
        let bytes = gathered(|out| write_header(text, out));
        let padded = length.div_ceil(8) * 8;
        let mut expected =
            [&FILE_MAGIC[..], &FORMAT.to_le_bytes(), &(padded as u32).to_le_bytes(), text.as_bytes()].concat();
        expected.resize(16 + padded, b'\n');
        let sum = crc(&expected);
        expected.extend(sum.to_le_bytes());
        assert_eq!(bytes, expected, "{length}");
    }
    let block = [BLOCK_MAGIC, 3, u64::MAX - 5];
    let words = block.map(u64::to_le_bytes).concat();
    assert_eq!(checksum(&block), crc(&words));
    assert_eq!(gathered(|out| write_block(&block, out)), [&words[..], &crc(&words).to_le_bytes()].concat());
    // The first piece that is not taken ends it.
    for fails_at in 0..4 {
        let mut pieces = 0;
        let ended = write_block(&block, |_| {
            pieces += 1;
            if pieces > fails_at { Err(pieces) } else { Ok(()) }
        });
        assert_eq!(ended, Err(fails_at + 1));
    }
    for (word, reason) in (0..).zip([Reason::Started, Reason::Continued, Reason::Settings]) {
        assert_eq!((reason.word(), Reason::from_word(word)), (word, Some(reason)));
    }
    assert_eq!(Reason::from_word(3), None);
    assert_eq!(&BLOCK_MAGIC.to_le_bytes(), b"SPGBLOCK");
}
