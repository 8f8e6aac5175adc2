//! What waits for the edge of the input line: when it may, in which tick it begins, and what drops it.

#![allow(clippy::unwrap_used)] // A panic is a failed test.

use controller::supervised::{CONVERTER, Cause, Phase};
use controller::{COMMAND_WORDS, CommandKind, Config, ControlMode, GENERATOR_BUSY, waves};
use specgen_board::TargetStatus;
use specgen_hal::Fault;
use specgen_link::client::Client;
use specgen_link::{Bytes, EdgeStatus, PassAction, Refusal, Reply, Request, Silence, WaveAction};
use specgen_runtime::pending::{EDGE, Stage};

use crate::ask;
use crate::board_support::{Line, bytes, done, refused, running, wave};

/// A machine that runs at its bias pose; time stands while the host waits.
fn ready() -> (Line, Client<Line>) {
    let line = Line::new(0);
    let mut client = line.client(2);
    running(&line, &mut client);
    line.with(|rig| rig.pace = 0);
    (line, client)
}

/// A micrometre up.
fn step() -> Vec<u8> {
    let mut words = [0; COMMAND_WORDS];
    words[0] = CommandKind::Move.word();
    words[2] = 77;
    words[5] = 1e-6_f64.to_bits();
    bytes(&words)
}

fn edge(client: &mut Client<Line>) -> EdgeStatus {
    match client.ask(&Request::Edge { drop: false }).unwrap() {
        Reply::Edge(status) => status,
        other => unreachable!("{other:?}"),
    }
}

/// Stage and edges, whoever has the session.
fn told(line: &Line) -> (u64, u32) {
    line.with(|rig| {
        ask(&mut rig.exchange, rig.board.machine_mut(), Request::Edge { drop: false }, |reply| match reply {
            Reply::Edge(status) => (u64::from(status.stage), status.edges),
            other => unreachable!("{other:?}"),
        })
    })
}

fn stage(client: &mut Client<Line>) -> u64 {
    u64::from(edge(client).stage)
}

fn number(line: &Line) -> u64 {
    line.with(|rig| rig.exchange.report.tick)
}

fn kind(line: &Line) -> u64 {
    line.with(|rig| rig.exchange.command.command[0])
}

/// Low for two ticks, then high in the next one, whose number is given.
fn rise(line: &Line) -> u64 {
    line.parts(|parts| parts.input = false);
    line.tick(2);
    line.parts(|parts| parts.input = true);
    line.with(|rig| rig.exchange.report.health.events = 0);
    let tick = number(line);
    line.tick(1);
    tick
}

#[test]
fn a_command_that_waits_is_in_force_from_the_tick_after_the_edge_on() {
    let (line, mut client) = ready();
    assert_eq!(edge(&mut client), EdgeStatus { stage: Stage::None.word() as u8, edges: 0, tick: 0 });
    let words = step();
    // High since before is no edge.
    line.parts(|parts| parts.input = true);
    line.tick(1);
    done(&mut client, &Request::SetpointOnEdge { words: Bytes(&words) });
    line.tick(3);
    assert_eq!((stage(&mut client), kind(&line)), (Stage::Waiting.word(), CommandKind::Hold.word()));
    let at = rise(&line);
    assert_ne!(line.with(|rig| rig.exchange.report.health.events) & EDGE, EDGE, "none of the events that are told");
    assert_eq!(edge(&mut client), EdgeStatus { stage: Stage::Begun.word() as u8, edges: 2, tick: at });
    assert_eq!(bytes(&line.with(|rig| rig.exchange.command.command)), words);
    line.tick(2);
    assert_ne!(line.with(|rig| rig.exchange.report.status) & GENERATOR_BUSY, 0);
    // Once.
    line.with(|rig| rig.exchange.command.command[0] = CommandKind::Hold.word());
    rise(&line);
    assert_eq!((kind(&line), edge(&mut client).edges), (CommandKind::Hold.word(), 3));
}

#[test]
fn a_wave_that_waits_begins_with_the_tick_after_the_edge() {
    let (line, mut client) = ready();
    let words = bytes(&wave(1e-6, 5.0).to_words());
    let start = Request::Wave { action: WaveAction::StartOnEdge, words: Bytes(&words) };
    done(&mut client, &start);
    line.tick(5);
    assert!(!line.with(|rig| rig.exchange.source.waves()) && line.with(|rig| rig.exchange.source.wave.is_some()));
    let at = rise(&line);
    assert_eq!(edge(&mut client), EdgeStatus { stage: Stage::Begun.word() as u8, edges: 1, tick: at });
    assert!(line.with(|rig| rig.exchange.source.waves()));
    assert_eq!(kind(&line), CommandKind::Stream.word());
    // A stop drops what waits and lets a wave that is under way come to rest.
    done(&mut client, &Request::Wave { action: WaveAction::Stop, words: Bytes(&[]) });
    assert!(line.with(|rig| rig.exchange.source.waves()));
}

#[test]
fn new_settings_leave_a_wave_that_waits_as_it_is() {
    let (line, mut client) = ready();
    let words = bytes(&wave(1e-6, 5.0).to_words());
    done(&mut client, &Request::Wave { action: WaveAction::StartOnEdge, words: Bytes(&words) });
    let limits = waves::limits(&Config::new());
    for mode in ControlMode::all() {
        let config = Config::new().with(|settings| settings.mode = mode).unwrap();
        assert_eq!(waves::limits(&config), limits, "{mode}");
        done(&mut client, &Request::WriteConfig { words: Bytes(&bytes(&config.to_words())) });
        line.tick(2);
    }
    assert_eq!(stage(&mut client), Stage::Waiting.word());
    rise(&line);
    assert_eq!(stage(&mut client), Stage::Begun.word());
}

#[test]
fn only_a_machine_that_runs_at_rest_waits_for_an_edge() {
    let (line, mut client) = ready();
    let (command, settings) = (step(), bytes(&wave(1e-6, 5.0).to_words()));
    let mut all_refused = |why: &str| {
        let on_edge = Request::SetpointOnEdge { words: Bytes(&command) };
        assert_eq!(refused(&mut client, &on_edge), Refusal::State, "{why}");
        let on_edge = Request::Wave { action: WaveAction::StartOnEdge, words: Bytes(&settings) };
        assert_eq!(refused(&mut client, &on_edge), Refusal::State, "{why}");
        assert_eq!(stage(&mut client), Stage::None.word(), "{why}");
        assert!(
            line.with(|rig| rig.exchange.source.wave.as_ref().is_none_or(|_| rig.exchange.source.waves())),
            "{why}"
        );
    };
    for phase in [Phase::Disarmed, Phase::Arming, Phase::Holding, Phase::RampingDown, Phase::Faulted] {
        line.with(|rig| rig.exchange.report.phase = phase);
        all_refused("not running");
    }
    line.with(|rig| rig.exchange.report.phase = Phase::Running);
    line.with(|rig| rig.exchange.report.status |= GENERATOR_BUSY);
    all_refused("moving");
    line.with(|rig| rig.exchange.report.status &= !GENERATOR_BUSY);
    line.with(|rig| rig.exchange.lockstep = Some(Silence::new(1000)));
    all_refused("in lock-step");
    line.with(|rig| rig.exchange.lockstep = None);
    let begin = PassAction::Begin { spacing: 10, before: 100, ticks: 200, trajectory: 0 };
    let mut other = line.client(3);
    other.ask(&Request::Pass { action: begin }).unwrap();
    let mut client = line.client(4);
    line.with(|rig| assert!(!rig.exchange.source.is_engaged()));
    client.ask(&Request::Pass { action: begin }).unwrap();
    assert_eq!(refused(&mut client, &Request::SetpointOnEdge { words: Bytes(&command) }), Refusal::State);
    client.ask(&Request::Pass { action: PassAction::Abort }).unwrap();
    done(&mut client, &Request::Wave { action: WaveAction::Start, words: Bytes(&settings) });
    assert_eq!(refused(&mut client, &Request::SetpointOnEdge { words: Bytes(&command) }), Refusal::State);
    assert!(line.with(|rig| rig.exchange.source.waves()));
    let short = Request::SetpointOnEdge { words: Bytes(&command[..8]) };
    assert_eq!(refused(&mut client, &short), Refusal::Length { expected: COMMAND_WORDS as u16 });
}

#[test]
fn what_waits_is_refused_at_an_edge_in_motion() {
    let words = step();
    let settings = bytes(&wave(1e-6, 5.0).to_words());
    let orders = [
        Request::SetpointOnEdge { words: Bytes(&words) },
        Request::Wave { action: WaveAction::StartOnEdge, words: Bytes(&settings) },
    ];
    for order in orders {
        let (line, mut client) = ready();
        line.parts(|parts| parts.input = false);
        line.tick(2);
        done(&mut client, &order);
        // A motion that nobody ordered over the link, so that it does not drop what waits.
        line.with(|rig| {
            rig.exchange.command.command[0] = CommandKind::Move.word();
            rig.exchange.command.command[5] = 1e-6_f64.to_bits();
        });
        line.tick(3);
        assert_ne!(line.with(|rig| rig.exchange.report.status) & GENERATOR_BUSY, 0);
        line.parts(|parts| parts.input = true);
        let at = number(&line);
        line.tick(1);
        assert_eq!(edge(&mut client), EdgeStatus { stage: Stage::Refused.word() as u8, edges: 1, tick: at });
        assert!(!line.with(|rig| rig.exchange.source.waves()), "{order:?}");
        assert_eq!(kind(&line), CommandKind::Move.word());
        // And so is it behind a trajectory, and while a pass is under way.
        for engaged in [false, true] {
            let (line, mut client) = ready();
            line.parts(|parts| parts.input = false);
            line.tick(2);
            done(&mut client, &order);
            line.with(|rig| {
                let exchange = &mut rig.exchange;
                if engaged {
                    let course = specgen_runtime::pass::Course { spacing: 10, before: 50, ticks: 100, trajectory: 0 };
                    assert!(exchange.source.player.as_mut().unwrap().begin(course));
                } else if matches!(order, Request::Wave { .. }) {
                    exchange.command.command[0] = CommandKind::Trajectory.word();
                    exchange.command.command[1] = 99;
                } else {
                    exchange.report.phase = Phase::Holding;
                    exchange.prepare();
                    exchange.report.phase = Phase::Running;
                }
            });
            line.parts(|parts| parts.input = true);
            line.tick(1);
            assert_ne!(stage(&mut client), Stage::Begun.word(), "{order:?} {engaged}");
            assert!(!line.with(|rig| rig.exchange.source.waves()));
            assert_ne!(kind(&line), CommandKind::Move.word());
        }
    }
}

type Dropper<'a> = &'a dyn Fn(&Line, &mut Client<Line>);

#[test]
fn what_waits_is_dropped_by_a_later_order_and_by_a_machine_that_stops() {
    let words = step();
    let settings = bytes(&wave(1e-6, 5.0).to_words());
    let on_edge = Request::SetpointOnEdge { words: Bytes(&words) };
    let wave_on_edge = Request::Wave { action: WaveAction::StartOnEdge, words: Bytes(&settings) };
    let hold = bytes(&[0; COMMAND_WORDS]);
    let pass = PassAction::Begin { spacing: 10, before: 10, ticks: 100, trajectory: 0 };
    let droppers: [Dropper<'_>; 7] = [
        &|_, client| assert!(matches!(client.ask(&Request::Edge { drop: true }).unwrap(), Reply::Edge(_))),
        &|_, client| done(client, &Request::Setpoint { words: Bytes(&hold) }),
        &|_, client| done(client, &Request::Wave { action: WaveAction::Stop, words: Bytes(&[]) }),
        &|line, _| {
            line.client(9);
        },
        &|_, client| {
            client.ask(&Request::Pass { action: pass }).unwrap();
        },
        &|_, client| done(client, &Request::Wave { action: WaveAction::Start, words: Bytes(&settings) }),
        &|line, client| {
            done(client, &Request::Supervise { request: 3 });
            line.tick(2);
            assert_ne!(line.phase(), Phase::Running);
        },
    ];
    for (number, dropper) in droppers.iter().enumerate() {
        for order in [on_edge, wave_on_edge] {
            let (line, mut client) = ready();
            line.parts(|parts| parts.input = false);
            line.tick(2);
            done(&mut client, &order);
            dropper(&line, &mut client);
            // A wave that was ordered at once goes on; one that only waited is gone.
            line.with(|rig| assert_eq!(rig.exchange.source.wave.is_some(), rig.exchange.source.waves(), "{number}"));
            assert_eq!(told(&line), (Stage::Dropped.word(), 0), "{number}");
            line.parts(|parts| parts.input = true);
            line.tick(2);
            assert_eq!(told(&line), (Stage::Dropped.word(), 1), "{number}");
            assert_ne!(kind(&line), CommandKind::Move.word(), "{number}");
        }
    }
}

#[test]
fn an_input_line_that_does_not_answer_is_a_fault_of_a_converter() {
    let (line, mut client) = ready();
    done(&mut client, &Request::SetpointOnEdge { words: Bytes(&step()) });
    line.parts(|parts| (parts.input, parts.input_fails) = (false, true));
    line.with(|rig| rig.exchange.report.health.events = 0);
    line.tick(1);
    let (faults, events) = line.with(|rig| (rig.exchange.report.health.faults, rig.exchange.report.health.events));
    assert_eq!((faults, events & CONVERTER), (Fault::Pin.bit(), 0));
    // The supervisor hears of it with the next tick.
    line.tick(1);
    assert_eq!(line.with(|rig| rig.exchange.report.health.events) & CONVERTER, CONVERTER);
    // Behind the gap it has to be low before it can rise.
    line.parts(|parts| (parts.input, parts.input_fails) = (true, false));
    line.tick(2);
    assert_eq!(stage(&mut client), Stage::Waiting.word());
    rise(&line);
    assert_eq!(stage(&mut client), Stage::Begun.word());
}

#[test]
fn an_edge_hides_no_other_event_of_its_tick() {
    let (line, _) = ready();
    line.parts(|parts| parts.input = false);
    line.tick(2);
    line.parts(|parts| parts.input = true);
    line.with(|rig| {
        assert_eq!(rig.exchange.report.cause, Cause::None);
        rig.board.tick(&mut rig.exchange, TargetStatus { missed: 0, stop: true, amplifier: false });
        assert_eq!(rig.exchange.report.cause, Cause::EmergencyStop);
    });
}

/// One line, high in motion.
#[test]
fn output_lines_are_what_the_controller_says() {
    let (line, mut client) = ready();
    assert_eq!(line.parts(|parts| parts.lines), 0);
    done(&mut client, &Request::Setpoint { words: Bytes(&step()) });
    line.tick(5);
    assert_eq!(line.parts(|parts| parts.lines), 1);
    line.tick(20_000);
    assert_eq!(line.parts(|parts| parts.lines), 0);
}
