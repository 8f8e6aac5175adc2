//! What a board answers, and that a refused request changes nothing.

#![allow(clippy::unwrap_used)]

use controller::supervised::{Machine, Phase, Request as Wanted, machine_at_reset};
use controller::{CONFIG_WORDS, Config, DESCRIPTION};
use specgen_board::{COMMAND_WORDS, Exchange, LinkHandler, RequestContext, Stopwatch};
use specgen_link::{Bytes, CostUnit, Device, RecorderAction, Refusal, Reply, Request};

fn bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// A board without ticks.
struct Bench {
    exchange: Exchange,
    machine: Box<Machine>,
    handler: LinkHandler,
}

impl Bench {
    fn new() -> Self {
        Self {
            exchange: Exchange::new(),
            machine: Box::new(machine_at_reset()),
            handler: LinkHandler::new(Stopwatch::NONE),
        }
    }

    /// Asks, and looks at the answer.
    fn ask<R>(&mut self, request: &Request<'_>, look: impl FnOnce(Reply<'_>) -> R) -> R {
        let Self { exchange, machine, handler } = self;
        let mut with = |action: &mut dyn FnMut(&mut Exchange, &mut Machine)| action(exchange, machine);
        look(RequestContext { handler, with: &mut with }.execute(request))
    }

    fn expect(&mut self, request: &Request<'_>, expected: Reply<'_>) {
        self.ask(request, |reply| assert_eq!(reply, expected, "{request:?}"));
    }
}

#[test]
fn orders_reach_the_tick_all_at_once() {
    let mut bench = Bench::new();
    let words: Vec<u64> = (100..100 + COMMAND_WORDS as u64).collect();
    let setpoint = Request::Setpoint { words: Bytes(&bytes(&words)) };
    bench.expect(&setpoint, Reply::Refused(Refusal::State));
    bench.exchange.report.phase = Phase::Running;
    bench.expect(&setpoint, Reply::Done);
    bench.expect(&Request::Supervise { request: 2 }, Reply::Done);
    assert_eq!(bench.exchange.command.request, Wanted::Run);
    assert_eq!(bench.exchange.command.command[..], words);
    assert!(!bench.exchange.silence.tick(), "the host was heard");
    // A host that comes anew has not asked for anything.
    bench.ask(&Request::Hello, |reply| {
        let Reply::Identity(identity) = reply else { unreachable!() };
        assert_eq!((identity.counted, identity.stages), (CostUnit::Nothing, 0));
    });
    assert_eq!(bench.exchange.command.request, Wanted::None);
}

#[test]
fn what_was_commanded_before_the_machine_stopped_running_is_forgotten() {
    let mut bench = Bench::new();
    let words = bytes(&[2; COMMAND_WORDS]);
    for (phase, kept) in [(Phase::Running, true), (Phase::Holding, false)] {
        bench.exchange.report.phase = phase;
        if kept {
            bench.expect(&Request::Setpoint { words: Bytes(&words) }, Reply::Done);
        }
        bench.exchange.prepare();
        assert_eq!(bench.exchange.command.command[0] == 2, kept, "{phase:?}");
    }
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut bench = Bench::new();
    let mut config = Config::new().to_words();
    config[0] = u64::MAX;
    let good = bytes(&Config::new().to_words());
    let refused = [
        (Request::Supervise { request: 7 }, Refusal::Word { index: 0 }),
        (Request::Supervise { request: 255 }, Refusal::Word { index: 0 }),
        (Request::Setpoint { words: Bytes(&[0; 8]) }, Refusal::Length { expected: COMMAND_WORDS as u16 }),
        (Request::WriteConfig { words: Bytes(&[0; 7]) }, Refusal::Length { expected: CONFIG_WORDS as u16 }),
        (Request::WriteConfig { words: Bytes(&bytes(&config)) }, Refusal::Word { index: 0 }),
        // Nothing counts here, there is no recorder, no tick has shown yet that nothing moves.
        (Request::LockstepStage { index: 0 }, Refusal::Unsupported),
        (Request::Recorder { action: RecorderAction::Look }, Refusal::Unsupported),
        (Request::Download { offset: 0 }, Refusal::Unsupported),
        (Request::Stop, Refusal::Unsupported),
        (Request::LockstepReset { config: Bytes(&good) }, Refusal::State),
        (Request::LockstepStep { input: Bytes(&[]) }, Refusal::State),
    ];
    let (orders, settings) = (bench.exchange.command, bench.exchange.settings().to_words());
    let digest = bench.machine.digest();
    for (request, refusal) in refused {
        bench.expect(&request, Reply::Refused(refusal));
        assert_eq!(bench.exchange.command.command, orders.command);
        assert_eq!(bench.exchange.command.request, orders.request);
        assert_eq!(bench.exchange.settings().to_words(), settings);
        assert!(bench.exchange.lockstep.is_none());
        assert_eq!(bench.machine.digest(), digest);
    }
    // In a lock-step that is there, or could be, settings that are none do not begin one.
    bench.exchange.report.tick = 1;
    bench
        .expect(&Request::LockstepReset { config: Bytes(&bytes(&config)) }, Reply::Refused(Refusal::Word { index: 0 }));
    assert!(bench.exchange.lockstep.is_none());
    assert_eq!((bench.exchange.settings().to_words(), bench.machine.digest()), (settings, digest));
}

#[test]
fn settings_go_in_and_come_out() {
    let mut bench = Bench::new();
    let mode = Config::new()
        .with(|settings| settings.mode = controller::ControlMode::from_word(0).unwrap())
        .unwrap()
        .to_words();
    assert_ne!(mode, bench.exchange.settings().to_words());
    bench.expect(&Request::WriteConfig { words: Bytes(&bytes(&mode)) }, Reply::Done);
    assert_eq!(bench.exchange.settings().to_words(), mode);
    bench.expect(&Request::ReadConfig, Reply::Config { words: Bytes(&bytes(&mode)) });
}

#[test]
fn the_description_comes_in_pieces() {
    let mut bench = Bench::new();
    let mut text = Vec::new();
    loop {
        let piece = bench.ask(&Request::Describe { offset: text.len() as u32 }, |reply| {
            let Reply::Chunk { offset, total, bytes } = reply else { unreachable!() };
            assert_eq!((offset as usize, total as usize), (text.len(), DESCRIPTION.len()));
            bytes.0.to_vec()
        });
        if piece.is_empty() {
            break;
        }
        text.extend(piece);
    }
    assert_eq!(text, DESCRIPTION.as_bytes());
    bench.ask(&Request::Describe { offset: u32::MAX }, |beyond| {
        assert!(matches!(beyond, Reply::Chunk { bytes: Bytes(&[]), .. }));
    });
}

/// A status, which a host asks for all the time, forgets no event; the host that asks for health has seen them.
#[test]
fn events_are_kept_until_the_host_has_them() {
    let mut bench = Bench::new();
    bench.exchange.report.health.events = 0b0101;
    bench.ask(&Request::ReadConfig, |_| ());
    assert_eq!(bench.exchange.report.health.events, 0b0101);
    bench.ask(&Request::Status, |reply| {
        let Reply::Status(status) = reply else { unreachable!() };
        assert_eq!(status.events, 0b0101);
    });
    bench.exchange.report.health.events |= 0b1000;
    bench.exchange.report.health.overruns = 7;
    bench.exchange.probes.stack = || [100, 200];
    for (events, expected) in [(0, 0b1101), (0b10, 0b10), (0, 0)] {
        bench.exchange.report.health.events |= events;
        bench.ask(&Request::Health, |reply| {
            let Reply::Health(health) = reply else { unreachable!() };
            assert_eq!((health.events, health.stack), (expected, Some([100, 200])));
            // Nothing was timed yet.
            assert_eq!((health.overruns, health.tick, health.output, health.latest), (None, None, None, None));
        });
    }
    bench.exchange.probes.hertz = 1_000;
    (bench.exchange.report.health.tick, bench.exchange.report.health.output) = ([10, 20], [0, 0]);
    bench.ask(&Request::Health, |reply| {
        let Reply::Health(health) = reply else { unreachable!() };
        assert_eq!((health.overruns, health.tick, health.output), (Some(7), Some([10, 20]), None));
        assert_eq!((health.latest, health.clock), (Some(0), 1_000));
    });
}

/// A pose is as old as the last tick whose gauges were read and believed.
#[test]
fn a_place_says_when_its_pose_was_measured() {
    let mut bench = Bench::new();
    let period = u64::from(specgen_board::PERIOD_NANOSECONDS);
    for (tick, measured) in [(0, None), (9, None), (9, Some(9)), (100_009, Some(9))] {
        (bench.exchange.report.tick, bench.exchange.report.measured) = (tick, measured);
        let expected = measured.map(|measured: u64| (tick - measured) * period / 1000);
        bench.ask(&Request::Place, |reply| match reply {
            Reply::Place { measured, .. } => assert_eq!(measured, expected),
            other => panic!("{other:?}"),
        });
        bench.ask(&Request::Status, |reply| {
            let Reply::Status(status) = reply else { unreachable!() };
            assert_eq!(status.age, (tick > 0).then_some(0));
        });
    }
}

/// Counts up by three at every look.
fn counter() -> u32 {
    use std::sync::atomic::{AtomicU32, Ordering};
    static NOW: AtomicU32 = AtomicU32::new(0);
    let count = NOW.fetch_add(1, Ordering::Relaxed);
    3 * count + if count % 4 < 3 { 0 } else { 5 }
}

/// Steps of 3 and of 8 counts by turns: the whole tick is the only stage.
#[test]
fn what_the_steps_of_a_lock_step_cost_is_told() {
    let mut bench = Bench::new();
    bench.handler = LinkHandler::new(Stopwatch { counted: CostUnit::Cycles, now: counter });
    bench.ask(&Request::Hello, |reply| {
        let Reply::Identity(identity) = reply else { unreachable!() };
        assert_eq!((identity.counted, identity.stages), (CostUnit::Cycles, 1));
    });
    let stage = |bench: &mut Bench| {
        bench.ask(&Request::LockstepStage { index: 0 }, |reply| {
            let Reply::Stage(stage) = reply else { unreachable!("{reply:?}") };
            [stage.calls, stage.smallest, stage.sum, stage.largest]
        })
    };
    assert_eq!(stage(&mut bench), [0; 4]);
    (bench.exchange.report.tick, bench.exchange.report.phase) = (1, Phase::Disarmed);
    let config = bytes(&Config::new().to_words());
    bench.expect(&Request::LockstepReset { config: Bytes(&config) }, Reply::Done);
    let input = bytes(&[0; controller::supervised::MACHINE_INPUT_WORDS]);
    for number in 0..5 {
        bench.ask(&Request::LockstepStep { input: Bytes(&input) }, |reply| {
            let Reply::Stepped { cost, .. } = reply else { unreachable!("{reply:?}") };
            assert_eq!(cost, if number % 2 == 0 { 3 } else { 8 });
        });
    }
    assert_eq!(stage(&mut bench), [5, 3, 3 * 3 + 2 * 8, 8]);
    bench.expect(&Request::LockstepStage { index: 1 }, Reply::Refused(Refusal::Unsupported));
}
