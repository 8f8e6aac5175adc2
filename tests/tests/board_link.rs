//! A board, its tick, its recorder and its waves, through the frames of the link: what is downloaded replays bit for bit on the
//! host, whatever happens to the line; a lock-step computes what the host computes and moves nothing.

mod board_support;

use std::io::Cursor;

use board_support::Line;
use controller::supervised::{MACHINE_INPUT_WORDS, Machine, MachineInput, Phase, machine_output_words, supervise};
use controller::{CONFIG_WORDS, Config, ControlMode};
use host_sim::controller::Supervised;
use host_sim::record::{Reader, Replay, replay};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_board::COMMAND_WORDS;
use specgen_link::client::{Client, ClientError};
use specgen_link::{Bytes, RecorderAction, RecorderStatus, Refusal, Reply, Request, WaveAction};
use specgen_runtime::wave::{AxisWave, Refused, Settings, Shape, Tone, step_of};
use specgen_tests::Emitted;

/// Words of the recorder's memory: eight blocks of some 200 ticks.
const RECORD: usize = 40_000;
const PERIOD: f64 = controller::PERIOD_SECONDS;

fn bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn done(client: &mut Client<Line>, request: &Request<'_>) {
    assert_eq!(client.ask(request).unwrap(), Reply::Done, "{request:?}");
}

fn refused(client: &mut Client<Line>, request: &Request<'_>) -> Refusal {
    match client.ask(request) {
        Err(ClientError::Refused(refusal)) => refusal,
        other => panic!("{request:?}: {other:?}"),
    }
}

fn record(client: &mut Client<Line>, action: RecorderAction) -> RecorderStatus {
    match client.ask(&Request::Recorder { action }).unwrap() {
        Reply::Recorder(status) => status,
        other => panic!("{other:?}"),
    }
}

/// Asks for status until the machine is where it is to be.
fn wait(line: &Line, client: &mut Client<Line>, what: &str, mut there: impl FnMut(&Line) -> bool) {
    for _ in 0..20_000 {
        client.ask(&Request::Status).unwrap();
        if there(line) {
            return;
        }
    }
    panic!("{what}: still {:?}", line.with(|rig| rig.exchange.report));
}

/// Armed, running, at the bias pose.
fn running(line: &Line, client: &mut Client<Line>) {
    line.with(|rig| rig.pace = 50);
    done(client, &Request::Supervise { request: 1 });
    wait(line, client, "arming", |line| line.phase() == Phase::Arming);
    done(client, &Request::Supervise { request: 2 });
    wait(line, client, "running", |line| line.phase() == Phase::Running);
    let busy = |line: &Line| line.with(|rig| rig.exchange.report.status & controller::GENERATOR_BUSY != 0);
    wait(line, client, "bias", |line| !busy(line));
    line.with(|rig| rig.pace = 3);
}

fn wave(amplitude: f64, frequency: f64) -> Settings<f64> {
    let mut settings = Settings::still();
    for (axis, wave) in settings.axes.iter_mut().enumerate() {
        let scale = if axis < 3 { 1.0 } else { 10.0 };
        let tone = Tone { amplitude: amplitude * scale, phase: 0, step: step_of(frequency + axis as f64, PERIOD) };
        *wave = AxisWave { offset: 0.0, shape: Shape::Sine { tone } };
    }
    settings.ramp_ticks = 300;
    settings
}

fn again(bytes: &[u8], machine: &mut Supervised) -> Replay {
    let mut reader = Reader::new(Cursor::new(bytes)).unwrap();
    replay(&mut reader, machine, |_, _| ()).unwrap_or_else(|error| panic!("{error}"))
}

fn download(client: &mut Client<Line>) -> Vec<u8> {
    client.fetch(|offset| Request::Download { offset }).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn what_a_board_recorded_is_downloaded_and_replays_bit_for_bit() {
    let emitted = Emitted::new("board-link", "reference.toml", &[]);
    let mut machine = Supervised::new(emitted.controller()).unwrap();
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
    let mode = Config::new().with_mode(ControlMode::from_word(5).unwrap()).to_words();
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
    assert!(!status.running && status.triggered && status.ticks > 1000, "{status:?}");
    assert!(status.ticks >= status.capacity, "{status:?}: the ring is full");
    assert_eq!(line.phase(), Phase::Running);
    assert!(!line.with(|rig| rig.exchange.waves()), "the wave came to its end");

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
    assert!(!line.with(|rig| rig.exchange.waves()));
    let status = record(&mut client, RecorderAction::Look);
    assert!(!status.running && status.triggered, "{status:?}");
    let found = again(&download(&mut client), &mut machine);
    assert_eq!((found.divergence, found.triggers.len()), (None, 1));
}

#[test]
fn a_wave_is_refused_with_its_reason_and_a_host_that_falls_silent_ends_it() {
    let line = Line::new(RECORD);
    let mut client = line.client(2);
    let start = |client: &mut Client<Line>, settings: &Settings<f64>| {
        let words = bytes(&settings.to_words());
        match client.ask(&Request::Wave { action: WaveAction::Start, words: Bytes(&words) }) {
            Ok(Reply::Done) => None,
            Err(ClientError::Refused(refusal)) => Some(refusal),
            other => panic!("{other:?}"),
        }
    };
    client.ask(&Request::Status).unwrap();
    assert_eq!(start(&mut client, &wave(1e-6, 5.0)), Some(Refusal::State), "not running");
    running(&line, &mut client);
    let mut far = wave(1e-6, 5.0);
    far.axes[2].offset = 1e-3;
    let why = |refusal: Option<Refusal>| match refusal {
        Some(Refusal::Word { index }) => Refused::of_word(usize::from(index)),
        other => panic!("{other:?}"),
    };
    assert_eq!(why(start(&mut client, &far)), Refused::Range(2));
    assert_eq!(why(start(&mut client, &wave(2e-5, 60.0))), Refused::Rate(0));
    assert_eq!(why(start(&mut client, &wave(5e-7, 1590.0))), Refused::Acceleration(0));
    assert!(!line.with(|rig| rig.exchange.waves()));
    assert_eq!(start(&mut client, &wave(1e-6, 5.0)), None);
    line.tick(100);
    let waving = line.with(|rig| (rig.exchange.waves(), rig.exchange.report.status));
    assert_eq!((waving.0, waving.1 & controller::SETPOINT_FAULT), (true, 0));
    // 0.1 s of silence: the supervisor holds.
    line.tick(1100);
    assert!(!line.with(|rig| rig.exchange.waves()));
    assert_eq!(line.phase(), Phase::Holding);
}

/// Random inputs of a lock-step, those that arm the machine before them.
fn inputs(random: &mut ChaCha8Rng, tick: u32) -> [u64; MACHINE_INPUT_WORDS] {
    let mut words = [0; MACHINE_INPUT_WORDS];
    for word in &mut words[21..27] {
        *word = ((f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5) * 4e-9).to_bits();
    }
    words[0] = u64::from(random.next_u32() % 4);
    words[MACHINE_INPUT_WORDS - 2] = if tick < 10 { 1 } else { 2 };
    words
}

#[test]
fn a_lock_step_computes_what_the_host_computes_and_moves_nothing() {
    let line = Line::new(RECORD);
    let mut client = line.client(3);
    line.with(|rig| rig.pace = 1);
    client.ask(&Request::Status).unwrap();
    let at_rest = line.parts(|parts| parts.written).unwrap();
    let config = Config::new().with_mode(ControlMode::from_word(3).unwrap());
    let words = bytes(&config.to_words());
    assert_eq!(words.len(), CONFIG_WORDS * 8);
    done(&mut client, &Request::LockstepReset { config: Bytes(&words) });
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let (mut machine, mut moved) = (Machine::new(), 0);
    for tick in 0..2500 {
        let input = inputs(&mut random, tick);
        let output = supervise(&config, &mut machine, &MachineInput::from_words(&input));
        let (digest, words) = match client.ask(&Request::LockstepStep { input: Bytes(&bytes(&input)) }).unwrap() {
            Reply::Stepped { digest, output, .. } => (digest, output.0.to_vec()),
            other => panic!("{other:?}"),
        };
        assert_eq!(digest, machine.digest(), "tick {tick}");
        assert!(words == bytes(&machine_output_words(&output, &machine)), "tick {tick}");
        moved += u32::from(output.amplifier_on && output.tick.dac_code != at_rest);
    }
    assert!(moved > 100, "the machine in lock-step went nowhere: this tested nothing");
    line.parts(|parts| assert_eq!((parts.written, parts.switched_on), (Some(at_rest), 0)));
    // Nobody gives other orders meanwhile.
    assert_eq!(refused(&mut client, &Request::Supervise { request: 1 }), Refusal::State);
    let settings = wave(1e-6, 5.0).to_words();
    let start = Request::Wave { action: WaveAction::Start, words: Bytes(&bytes(&settings)) };
    assert_eq!(refused(&mut client, &start), Refusal::State);
    // Two seconds of silence give the machine back, as at power-up.
    line.tick(19_990);
    assert!(line.with(|rig| rig.exchange.lockstep.is_some()));
    line.tick(20);
    let input = bytes(&inputs(&mut random, 0));
    assert_eq!(refused(&mut client, &Request::LockstepStep { input: Bytes(&input) }), Refusal::State);
    line.with(|rig| assert_eq!(rig.exchange.config.to_words(), Config::new().to_words()));
    // So does a host that comes anew, and then the platform can be run; a host that wants a lock-step then cannot have it.
    done(&mut client, &Request::LockstepReset { config: Bytes(&words) });
    let mut client = line.client(4);
    assert_eq!(refused(&mut client, &Request::LockstepStep { input: Bytes(&input) }), Refusal::State);
    assert!(line.with(|rig| rig.exchange.lockstep.is_none()));
    running(&line, &mut client);
    assert_eq!(refused(&mut client, &Request::LockstepReset { config: Bytes(&words) }), Refusal::State);
    assert_eq!(line.phase(), Phase::Running);
    // The record goes on over it: two pieces, each of which replays.
    line.with(|rig| rig.pace = 1);
    record(&mut client, RecorderAction::Stop);
    let bytes = download(&mut client);
    let emitted = Emitted::new("board-link", "reference.toml", &[]);
    let found = again(&bytes, &mut Supervised::new(emitted.controller()).unwrap());
    assert_eq!((found.divergence, found.damaged.len()), (None, 0));
    assert!(found.ticks > 1000, "{}", found.ticks);
}
