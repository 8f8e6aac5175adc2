//! A board through the frames of its link: waves are refused with their reason and end with the host, a lock-step computes what the
//! host computes and moves nothing. What is recorded and downloaded: `tests/tests/board_link.rs`.

#![allow(clippy::unwrap_used)] // A panic is a failed test.

use crate::board_support::{Line, bytes, done, refused, running, wave};
use controller::supervised::{
    MACHINE_INPUT_WORDS, MachineInput, Phase, machine_at_reset, machine_output_words, supervise,
};
use controller::{CONFIG_WORDS, Config, ControlMode};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_link::client::{Client, ClientError};
use specgen_link::{Bytes, Refusal, Reply, Request, WaveAction};
use specgen_runtime::wave::{self, Settings};

/// Words of the recorder's memory.
const RECORD: usize = 40_000;

#[test]
fn a_wave_is_refused_with_its_reason_and_a_host_that_falls_silent_ends_it() {
    let line = Line::new(RECORD);
    let mut client = line.client(2);
    let start = |client: &mut Client<Line>, settings: &Settings<f64>| {
        let words = bytes(&settings.to_words());
        match client.ask(&Request::Wave { action: WaveAction::Start, words: Bytes(&words) }) {
            Ok(Reply::Done) => None,
            Err(ClientError::Refused(refusal)) => Some(refusal),
            other => unreachable!("{other:?}"),
        }
    };
    client.ask(&Request::Status).unwrap();
    assert_eq!(start(&mut client, &wave(1e-6, 5.0)), Some(Refusal::State), "not running");
    running(&line, &mut client);
    let mut far = wave(1e-6, 5.0);
    far.axes[2].offset = 1e-3;
    let why = |refusal: Option<Refusal>| match refusal {
        Some(Refusal::Word { index }) => wave::Refusal::of_word(usize::from(index)),
        other => unreachable!("{other:?}"),
    };
    assert_eq!(why(start(&mut client, &far)), wave::Refusal::Range(2));
    assert_eq!(why(start(&mut client, &wave(2e-5, 60.0))), wave::Refusal::Rate(0));
    assert_eq!(why(start(&mut client, &wave(2e-7, 2600.0))), wave::Refusal::Acceleration(0));
    assert!(!line.with(|rig| rig.exchange.source.waves()));
    assert_eq!(start(&mut client, &wave(1e-6, 5.0)), None);
    line.tick(100);
    let waving = line.with(|rig| (rig.exchange.source.waves(), rig.exchange.report.status));
    assert_eq!((waving.0, waving.1 & controller::SETPOINT_FAULT), (true, 0));
    // 0.1 s of silence: the supervisor holds.
    line.tick(1100);
    assert!(!line.with(|rig| rig.exchange.source.waves()));
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
    let config = Config::new().with(|settings| settings.mode = ControlMode::from_word(3).unwrap()).unwrap();
    let words = bytes(&config.to_words());
    assert_eq!(words.len(), CONFIG_WORDS * 8);
    done(&mut client, &Request::LockstepReset { config: Bytes(&words) });
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let (mut machine, mut moved) = (machine_at_reset(), 0);
    for tick in 0..2500 {
        let input = inputs(&mut random, tick);
        let output = supervise(&config, &mut machine, &MachineInput::from_words(&input));
        let (digest, words) = match client.ask(&Request::LockstepStep { input: Bytes(&bytes(&input)) }).unwrap() {
            Reply::Stepped { digest, output, .. } => (digest, output.0.to_vec()),
            other => unreachable!("{other:?}"),
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
    // An emergency stop is told all the same.
    line.with(|rig| {
        rig.exchange.report.health.events = 0;
        rig.board.tick(&mut rig.exchange, specgen_board::TargetStatus { missed: 2, stop: true, amplifier: false });
        assert_eq!(rig.exchange.report.health.events, controller::supervised::STOP);
        let missed = core::mem::replace(&mut rig.exchange.report.missed, 0);
        assert_eq!(missed, 2);
    });
    // Two seconds of silence give the machine back, as at power-up.
    line.tick(19_990);
    assert!(line.with(|rig| rig.exchange.lockstep.is_some()));
    line.tick(20);
    let input = bytes(&inputs(&mut random, 0));
    assert_eq!(refused(&mut client, &Request::LockstepStep { input: Bytes(&input) }), Refusal::State);
    line.with(|rig| assert_eq!(rig.exchange.settings().to_words(), Config::new().to_words()));
    // So does a host that comes anew, and then the platform can be run; a host that wants a lock-step then cannot have it.
    done(&mut client, &Request::LockstepReset { config: Bytes(&words) });
    let mut client = line.client(4);
    assert_eq!(refused(&mut client, &Request::LockstepStep { input: Bytes(&input) }), Refusal::State);
    assert!(line.with(|rig| rig.exchange.lockstep.is_none()));
    running(&line, &mut client);
    assert_eq!(refused(&mut client, &Request::LockstepReset { config: Bytes(&words) }), Refusal::State);
    assert_eq!(line.phase(), Phase::Running);
}

/// From a hold, with the legs somewhere: voltages of one leg, then a host that falls silent.
#[test]
fn a_wave_of_voltages_moves_its_leg_and_ends_with_the_host() {
    let line = Line::new(RECORD);
    let mut client = line.client(2);
    running(&line, &mut client);
    for (request, phase) in [(3, Phase::Holding), (6, Phase::Driving)] {
        done(&mut client, &Request::Supervise { request });
        line.tick(500);
        assert_eq!(line.phase(), phase);
    }
    let Ok(Reply::Place { words, .. }) = client.ask(&Request::Place) else { unreachable!() };
    let there: Vec<f64> = words.words(24).unwrap().skip(18).map(f64::from_bits).collect();
    let mut settings = Settings::<f64> { center: there.try_into().unwrap(), ramp_ticks: 100, ..Settings::still() };
    settings.axes[1] = wave(2.0, 10.0).axes[1];
    fn start(words: &[u8]) -> Request<'_> {
        Request::Wave { action: WaveAction::Start, words: Bytes(words) }
    }
    let mut elsewhere = settings;
    elsewhere.center[3] += 12.0;
    assert_eq!(refused(&mut client, &start(&bytes(&elsewhere.to_words()))), Refusal::State, "a leg would jump");
    let mut high = settings;
    high.axes[1].offset = 150.0;
    let refusal = refused(&mut client, &start(&bytes(&high.to_words())));
    let Refusal::Word { index } = refusal else { unreachable!() };
    assert_eq!(wave::Refusal::of_word(usize::from(index)), wave::Refusal::Range(1));
    let held = line.parts(|parts| parts.written).unwrap();
    let words = bytes(&settings.to_words());
    done(&mut client, &start(&words));
    assert_eq!(refused(&mut client, &start(&words)), Refusal::State, "one at a time");
    let mut moved = 0;
    for _ in 0..900 {
        line.tick(1);
        let codes = line.parts(|parts| parts.written).unwrap();
        for leg in [0, 2, 3, 4, 5] {
            assert_eq!(codes[leg], held[leg], "leg {leg}");
        }
        let way = (i64::from(codes[1]) - i64::from(held[1])).abs();
        moved = if way > moved { way } else { moved };
    }
    assert_eq!((line.phase(), moved > 500), (Phase::Driving, true), "{moved} codes");
    line.tick(1100);
    assert!(!line.with(|rig| rig.exchange.source.waves()));
    assert_eq!(line.phase(), Phase::Holding);
}
