//! What a board recorded, and what of it is downloaded: the bytes of the record's file, and blocks that begin with the machine as it was.
//! That they replay bit for bit: `tests/tests/board_link.rs`.

#![allow(clippy::unwrap_used)] // A panic is a failed test.

use std::collections::BTreeMap;

use controller::snapshot::{MACHINE_STATE_WORDS, RECORD_LAYOUT};
use controller::supervised::Phase;
use controller::{CONFIG_WORDS, Config, ControlMode, DESCRIPTION};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_link::client::{Client, ClientError};
use specgen_link::{Bytes, RecorderAction, RecorderStatus, Refusal, Reply, Request};
use specgen_runtime::record::{HEADER_WORDS, checksum, write_header};

use crate::board_support::{Line, bytes, done, refused, running, wait};

/// Words of the recorder's memory: eight blocks of some 90 ticks.
const RECORD: usize = 40_000;
/// Words that one answer carries at most.
const PIECE: usize = 64;

fn act(client: &mut Client<Line>, action: RecorderAction) -> RecorderStatus {
    match client.ask(&Request::Recorder { action }).unwrap() {
        Reply::Recorder(status) => status,
        other => unreachable!("{other:?}"),
    }
}

fn blocks(line: &Line) -> Vec<Vec<u64>> {
    line.with(|rig| {
        let recorder = rig.exchange.recorder.as_ref().unwrap();
        (0..recorder.blocks()).map(|index| recorder.block(index).unwrap().to_vec()).collect()
    })
}

/// The file of these blocks.
fn file(blocks: &[Vec<u64>]) -> Vec<u8> {
    let mut file = Vec::new();
    write_header(DESCRIPTION, |piece| {
        file.extend_from_slice(piece);
        Ok::<(), ()>(())
    })
    .unwrap();
    for block in blocks {
        file.extend(bytes(block));
        file.extend(checksum(block).to_le_bytes());
    }
    file
}

/// The machine after each tick, by its digest.
type Digests = BTreeMap<u64, (Vec<u64>, [u64; CONFIG_WORDS])>;

fn ticks(line: &Line, count: u32, known: &mut Digests) {
    for _ in 0..count {
        line.with(|rig| {
            let machine = rig.board.machine();
            let mut state = [0; MACHINE_STATE_WORDS];
            machine.save(&mut state);
            known.insert(machine.digest(), (state.to_vec(), rig.exchange.config.to_words()));
        });
        line.tick(1);
    }
}

#[test]
fn a_record_is_downloaded_as_the_bytes_of_its_file() {
    let line = Line::new(RECORD);
    let mut client = line.client(1);
    let status = act(&mut client, RecorderAction::Look);
    assert!(status.running && !status.triggered && status.capacity > 500, "{status:?}");
    assert_eq!(refused(&mut client, &Request::Download { offset: 0 }), Refusal::State);
    running(&line, &mut client);
    line.with(|rig| rig.pace = 0);

    assert!(act(&mut client, RecorderAction::Arm { after: 200 }).running);
    let mut known = Digests::new();
    ticks(&line, 600, &mut known);
    // Other settings in the middle.
    let config = Config::new().with(|settings| settings.mode = ControlMode::from_word(5).unwrap()).unwrap().to_words();
    done(&mut client, &Request::WriteConfig { words: Bytes(&bytes(&config)) });
    ticks(&line, 100, &mut known);
    line.with(|rig| assert_eq!(rig.exchange.config.to_words(), config));
    let triggered = act(&mut client, RecorderAction::Trigger);
    assert!(triggered.running && triggered.ticks >= 400, "{triggered:?}");
    ticks(&line, 1, &mut known);
    assert!(act(&mut client, RecorderAction::Look).triggered);
    ticks(&line, 300, &mut known);
    let status = act(&mut client, RecorderAction::Look);
    assert!(!status.running && status.triggered && status.ticks >= 500, "{status:?}");

    let blocks = blocks(&line);
    assert!(blocks.len() >= 3, "{} blocks", blocks.len());
    let mut settings = 0;
    for block in &blocks {
        let (head, rest) = block.split_at(HEADER_WORDS);
        let (state, of_then) = head.iter().find_map(|word| known.get(word)).expect("the digest of a tick");
        assert_eq!(rest[..CONFIG_WORDS], of_then[..]);
        assert!(rest[CONFIG_WORDS..RECORD_LAYOUT.preamble() - HEADER_WORDS] == state[..]);
        settings += u32::from(*of_then == config);
    }
    assert!((1..blocks.len() as u32).contains(&settings), "{settings}");

    let whole = file(&blocks);
    assert!(client.fetch(|offset| Request::Download { offset }).unwrap() == whole);
    // From any byte, in any order: what is there, up to a piece, a checksum or a header.
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let ends: Vec<usize> = (0..blocks.len()).map(|count| file(&blocks[..count]).len()).collect();
    let near = ends.iter().flat_map(|end| end.saturating_sub(20)..end + 20);
    let any = (0..600).map(|_| random.next_u32() as usize % (whole.len() + 9));
    for offset in near.chain(any).chain(0..40).chain(whole.len() - 20..whole.len() + 9) {
        let Reply::Chunk { offset: from, total, bytes } =
            client.ask(&Request::Download { offset: offset as u32 }).unwrap()
        else {
            unreachable!()
        };
        let rest = whole.get(offset..).unwrap_or_default();
        assert_eq!((from as usize, total as usize), (offset, whole.len()));
        assert!(rest.starts_with(bytes.0), "from byte {offset}");
        let block = ends.iter().rposition(|end| offset >= *end);
        let least = match block {
            None => (ends[0] - offset).min(bytes.0.len()),
            Some(block) => {
                let left = 8 * blocks[block].len() as isize - (offset - ends[block]) as isize;
                if left > 0 { (left as usize).min(8 * PIECE - offset % 8) } else { rest.len().min((left + 8) as usize) }
            }
        };
        assert_eq!(bytes.0.len(), least.min(rest.len()), "from byte {offset}");
    }
    // Again from the beginning, over a line that spoils one byte in 300.
    line.with(|rig| (rig.spoilt, rig.pace) = (3, 1));
    assert!(client.fetch(|offset| Request::Download { offset }).unwrap() == whole);
    line.with(|rig| rig.spoilt = 0);

    // Recording again there is nothing to fetch, and what was being fetched ends.
    assert!(act(&mut client, RecorderAction::Arm { after: 10 }).running);
    assert_eq!(refused(&mut client, &Request::Download { offset: 0 }), Refusal::State);
    line.tick(300);
    assert!(!act(&mut client, RecorderAction::Stop).running);
    assert!(client.fetch(|offset| Request::Download { offset }).is_ok_and(|file| file.len() > 8 * RECORD / 16));
}

/// A fault triggers by itself; then as much is kept as there was before, half of what there is room for.
#[test]
fn a_fault_ends_a_record_that_nobody_armed() {
    let line = Line::new(RECORD);
    let mut client = line.client(1);
    running(&line, &mut client);
    let capacity = act(&mut client, RecorderAction::Look).capacity;
    line.tick(200);
    line.parts(|parts| parts.fails = true);
    wait(&line, &mut client, "fault", |line| line.phase() == Phase::Faulted);
    assert!(act(&mut client, RecorderAction::Look).triggered);
    line.tick(capacity / 4);
    assert!(act(&mut client, RecorderAction::Look).running, "half of the room is for what follows");
    line.tick(capacity);
    let status = act(&mut client, RecorderAction::Look);
    assert!(!status.running && status.triggered, "{status:?}");
}

#[test]
fn memory_for_fewer_than_two_blocks_records_nothing() {
    let line = Line::new(RECORD_LAYOUT.preamble());
    let mut client = line.client(1);
    line.tick(10);
    for request in [Request::Recorder { action: RecorderAction::Look }, Request::Download { offset: 0 }] {
        assert!(matches!(client.ask(&request), Err(ClientError::Refused(Refusal::Unsupported))));
    }
    // With little, fewer blocks.
    let line = Line::new(3 * RECORD_LAYOUT.preamble());
    assert!(line.client(1).ask(&Request::Recorder { action: RecorderAction::Look }).is_ok());
}
