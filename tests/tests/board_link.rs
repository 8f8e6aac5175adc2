//! What a board recorded, through the frames of the link: what is downloaded replays bit for bit on the host, whatever happens
//! to the line, to the settings, or to the machine in between.

use std::io::Cursor;

use crate::board_support::{Line, bytes, done, refused, running, wait, wave};
use controller::supervised::Phase;
use controller::{Config, ControlMode};
use host_sim::controller::Supervised;
use host_sim::record::{Reader, Replay, replay};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_board::COMMAND_WORDS;
use specgen_link::client::Client;
use specgen_link::{Bytes, RecorderAction, RecorderStatus, Refusal, Reply, Request, WaveAction};
use specgen_tests::Emitted;

/// Words of the recorder's memory: eight blocks of some 200 ticks.
const RECORD: usize = 40_000;

fn record(client: &mut Client<Line>, action: RecorderAction) -> RecorderStatus {
    match client.ask(&Request::Recorder { action }).unwrap() {
        Reply::Recorder(status) => status,
        other => panic!("{other:?}"),
    }
}

fn again(bytes: &[u8], machine: &mut Supervised) -> Replay {
    let mut reader = Reader::new(Cursor::new(bytes)).unwrap();
    replay(&mut reader, machine, |_, _, _| ()).unwrap_or_else(|error| panic!("{error}"))
}

fn download(client: &mut Client<Line>) -> Vec<u8> {
    client.fetch(|offset| Request::Download { offset }).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn what_a_board_recorded_is_downloaded_and_replays_bit_for_bit() {
    let emitted = Emitted::reference("board-link");
    let mut machine = Supervised::new(emitted.at_run_time());
    let line = Line::new(RECORD);
    let mut client = line.client(1);
    // From power-up on it waits for a fault.
    let status = record(&mut client, RecorderAction::Look);
    assert!(status.running && !status.triggered);
    running(&line, &mut client);

    assert!(record(&mut client, RecorderAction::Arm { after: 500 }).running);
    line.tick(200);
    let words = bytes(&wave(1e-6, 5.0).to_words());
    done(&mut client, &Request::Wave { action: WaveAction::Start, words: Bytes(&words) });
    line.tick(700);
    assert_eq!(refused(&mut client, &Request::Setpoint { words: Bytes(&bytes(&[0; COMMAND_WORDS])) }), Refusal::State);
    assert_eq!(
        refused(&mut client, &Request::Wave { action: WaveAction::Start, words: Bytes(&words) }),
        Refusal::State
    );
    // Other settings in the middle.
    let mode = Config::new().with(|settings| settings.mode = ControlMode::from_word(5).unwrap()).unwrap().to_words();
    done(&mut client, &Request::WriteConfig { words: Bytes(&bytes(&mode)) });
    line.tick(100);
    assert_eq!(refused(&mut client, &Request::Download { offset: 0 }), Refusal::State);
    assert!(record(&mut client, RecorderAction::Trigger).running);
    client.ask(&Request::Status).unwrap();
    assert!(record(&mut client, RecorderAction::Look).triggered);
    done(&mut client, &Request::Wave { action: WaveAction::Stop, words: Bytes(&[]) });
    for _ in 0..100 {
        client.ask(&Request::Status).unwrap();
        line.tick(10);
    }
    let status = record(&mut client, RecorderAction::Look);
    assert!(!status.running && status.triggered && status.ticks > 800, "{status:?}");
    assert!(status.ticks >= status.capacity, "{status:?}: the ring is full");
    assert_eq!(line.phase(), Phase::Running);
    assert!(!line.with(|rig| rig.exchange.source.waves()), "the wave came to its end");

    let clean = download(&mut client);
    let found = again(&clean, &mut machine);
    println!("{} ticks in {} blocks, {} bytes, {} digests", found.ticks, found.blocks, clean.len(), found.digests);
    assert_eq!((&found.divergence, found.gaps.len(), found.damaged.len(), found.cut), (&None, 0, 0, None));
    assert_eq!((found.ticks, found.triggers.len()), (u64::from(status.ticks), 1));
    assert!(found.digests > 50 && found.blocks > 4);
    // The comparison is able to fail: one bit of a code, with a checksum that fits, is another machine.
    let mut other = clean.clone();
    let at = other.len() - 8 - 16;
    other[at] ^= 1;
    assert!(again(&other, &mut machine).damaged.len() == 1);

    // Nothing recorded meanwhile; the same bytes over a line that spoils one in 300, however the pieces come.
    line.with(|rig| rig.spoilt = 3);
    assert!(download(&mut client) == clean);
    assert!(client.damaged() > 10, "{}", client.damaged());
    line.with(|rig| rig.spoilt = 0);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for k in 0..400 {
        let offset = if k == 0 { clean.len() as u32 - 8 } else { random.next_u32() % (clean.len() as u32 + 9) };
        let Reply::Chunk { total, bytes, .. } = client.ask(&Request::Download { offset }).unwrap() else { panic!() };
        let rest = clean.get(offset as usize..).unwrap_or_default();
        assert_eq!(total as usize, clean.len());
        assert!(rest.starts_with(bytes.0) && (rest.is_empty() || !bytes.0.is_empty()), "from {offset}");
    }
    // A fault triggers by itself, and ends in what the supervisor does; a wave that was under way is over.
    record(&mut client, RecorderAction::Arm { after: 50 });
    done(&mut client, &Request::Wave { action: WaveAction::Start, words: Bytes(&words) });
    line.tick(500);
    line.parts(|parts| parts.fails = true);
    wait(&line, &mut client, "fault", |line| line.phase() == Phase::Faulted);
    line.tick(100);
    assert!(!line.with(|rig| rig.exchange.source.waves()));
    let status = record(&mut client, RecorderAction::Look);
    assert!(!status.running && status.triggered, "{status:?}");
    let found = again(&download(&mut client), &mut machine);
    assert_eq!((found.divergence, found.triggers.len()), (None, 1));

    // A lock-step in between resets the machine: what comes after it is a record of its own, and replays as well.
    line.parts(|parts| parts.fails = false);
    line.tick(10);
    for request in [4, 5] {
        done(&mut client, &Request::Supervise { request });
        line.tick(100);
    }
    wait(&line, &mut client, "rest", |line| line.phase() == Phase::Disarmed);
    record(&mut client, RecorderAction::Arm { after: 100 });
    line.tick(100);
    done(&mut client, &Request::LockstepReset { config: Bytes(&bytes(&Config::new().to_words())) });
    line.tick(10);
    let mut client = line.client(7);
    line.tick(100);
    record(&mut client, RecorderAction::Stop);
    let found = again(&download(&mut client), &mut machine);
    assert_eq!((found.divergence, found.damaged.len()), (None, 0));
    assert!(found.blocks >= 2 && found.ticks > 190, "{} ticks in {} blocks", found.ticks, found.blocks);
}
