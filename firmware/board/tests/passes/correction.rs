//! Passes of a motion that repeats: when one may begin, what the ticks are given, what is kept and learned.

#![allow(clippy::unwrap_used)] // A panic is a failed test.

use std::cell::Cell;

use controller::supervised::{Machine, Phase};
use controller::{COMMAND_WORDS, CommandKind, Real, SETPOINT_FAULT};
use specgen_board::{Exchange, learn};
use specgen_link::client::Client;
use specgen_link::{Bytes, KNOT, KNOTS, PassAction, PassStatus, Refusal, Reply, Request, WaveAction};
use specgen_runtime::learning::{HEAD, plan_rows};
use specgen_runtime::pass::Stage;
use specgen_runtime::playback::{self, Knot};

use crate::ask;
use crate::board_support::{KNOTS_OF_A_PASS, Line, Rig, bytes, done, refused, running, wait, wave};

const SPACING: u32 = 10;
const BEFORE: u32 = 30;
const TICKS: u32 = 200;
const BEGIN: PassAction = PassAction::Begin { spacing: SPACING, before: BEFORE, ticks: TICKS, trajectory: 1 };
const KNOTS_PLAYED: usize = (TICKS / SPACING) as usize;
/// Place of the correction in a command.
const CORRECTION: usize = COMMAND_WORDS - 6;

fn knot(number: usize) -> Knot {
    let number = number as i32;
    [1000 + 10 * number, -2000, 3000 - number, 400 * number, 5000, -6000]
}

fn put(client: &mut Client<Line>, first: u32, knots: &[Knot]) {
    for (part, first) in knots.chunks(KNOTS).zip((first..).step_by(KNOTS)) {
        let knots: Vec<u8> = part.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
        done(client, &Request::Knots { first, knots: Bytes(&knots) });
    }
}

fn knots(bytes: &[u8]) -> Vec<Knot> {
    Bytes(bytes).knots().unwrap().collect()
}

fn pass(client: &mut Client<Line>, action: PassAction) -> PassStatus {
    match client.ask(&Request::Pass { action }).unwrap() {
        Reply::Pass(status) => status,
        other => unreachable!("{other:?}"),
    }
}

fn stage(line: &Line) -> Stage {
    line.with(|rig| rig.exchange.source.player.as_ref().unwrap().stage())
}

fn given(line: &Line) -> ([Real; 6], [u64; 2]) {
    line.with(|rig| {
        let command = &rig.exchange.command.command;
        (core::array::from_fn(|axis| Real::from_bits(command[CORRECTION + axis])), [command[0], command[1]])
    })
}

/// A machine that runs at its bias pose.
fn ready() -> (Line, Client<Line>) {
    let line = Line::new(0);
    let mut client = line.client(2);
    running(&line, &mut client);
    (line, client)
}

#[test]
fn a_pass_gives_every_tick_its_correction_and_begins_the_trajectory_behind_the_rest() {
    let (line, mut client) = ready();
    let table: Vec<Knot> = (0..KNOTS_PLAYED).map(knot).collect();
    put(&mut client, 0, &table);
    // Time stands while the host waits: the first tick is the next one.
    line.with(|rig| rig.pace = 0);
    let before = given(&line);
    assert_eq!(before.0, [0.0; 6]);
    let status = pass(&mut client, BEGIN);
    let capacity = KNOTS_OF_A_PASS as u32;
    assert_eq!(status, PassStatus { stage: Stage::Running.word(), status: 0, knots: 0, capacity });
    assert!(line.with(|rig| rig.exchange.source.is_engaged() && !rig.exchange.source.waves()));
    let mut seen = 0;
    for tick in 0..=TICKS {
        let (correction, command) = given(&line);
        assert_eq!(correction, playback::at::<Real>(&table, SPACING, tick), "tick {tick}");
        let trajectory = [CommandKind::Trajectory.word(), 1];
        assert_eq!(command, if tick < BEFORE { before.1 } else { trajectory }, "tick {tick}");
        seen |= line.with(|rig| rig.exchange.report.status);
        line.tick(1);
        // One that is under way is no reason to begin another, nor to command something else.
        if tick == BEFORE + 10 {
            assert_eq!(refused(&mut client, &Request::Pass { action: BEGIN }), Refusal::State);
            let words = bytes(&[0; COMMAND_WORDS]);
            assert_eq!(refused(&mut client, &Request::Setpoint { words: Bytes(&words) }), Refusal::State);
            let number = [0; KNOT];
            assert_eq!(refused(&mut client, &Request::Knots { first: 0, knots: Bytes(&number) }), Refusal::State);
            assert_eq!(refused(&mut client, &Request::Errors { offset: 0 }), Refusal::State);
            assert_eq!(refused(&mut client, &Request::Correction { offset: 0 }), Refusal::State);
        }
    }
    assert_eq!(stage(&line), Stage::Complete);
    assert_eq!(given(&line).0, [0.0; 6], "after the last tick nothing is corrected");
    let end = pass(&mut client, PassAction::Look);
    assert_eq!((end.stage, end.knots), (Stage::Complete.word(), KNOTS_PLAYED as u32));
    assert_eq!((end.status & SETPOINT_FAULT, end.status & !seen), (0, 0), "{:x}", end.status);
    assert_ne!(end.status & controller::GENERATOR_BUSY, 0);
    // More than one answer holds, from any byte on.
    assert_eq!(knots(&client.fetch(|offset| Request::Correction { offset }).unwrap()), table);
    let whole = client.fetch(|offset| Request::Errors { offset }).unwrap();
    let kept = line.with(|rig| rig.exchange.source.player.as_ref().unwrap().errors().to_vec());
    assert!(knots(&whole) == kept && kept.len() == KNOTS_PLAYED && kept.iter().any(|knot| *knot != [0; 6]));
    for offset in [0, 1, KNOT - 1, KNOT, 3 * KNOT + 5, whole.len() - 1, whole.len(), whole.len() + 7] {
        match client.ask(&Request::Errors { offset: offset as u32 }).unwrap() {
            Reply::Chunk { offset: from, total, bytes } => {
                let left = whole.get(offset..).unwrap_or_default();
                let most = KNOTS * KNOT - offset % KNOT;
                assert_eq!((from as usize, total as usize), (offset, whole.len()));
                assert_eq!(bytes.0, left.get(..most).unwrap_or(left), "from byte {offset}");
            }
            other => unreachable!("{other:?}"),
        }
    }
}

#[test]
fn a_pass_begins_in_a_machine_that_runs_at_rest_and_nowhere_else() {
    let (line, mut client) = ready();
    line.with(|rig| rig.pace = 0);
    let begin = Request::Pass { action: BEGIN };
    let untouched = |line: &Line, why: &str| {
        assert_eq!(stage(line), Stage::None, "{why}");
        assert_eq!(given(line).0, [0.0; 6], "{why}");
    };
    let phases = [Phase::Disarmed, Phase::Arming, Phase::Holding, Phase::RampingDown, Phase::Faulted];
    for phase in phases {
        line.with(|rig| rig.exchange.report.phase = phase);
        assert_eq!(refused(&mut client, &begin), Refusal::State, "{phase:?}");
        untouched(&line, "not running");
    }
    line.with(|rig| rig.exchange.report.phase = Phase::Running);
    // Under way: a motion, a trajectory, a wave.
    line.with(|rig| rig.exchange.report.status |= controller::GENERATOR_BUSY);
    assert_eq!(refused(&mut client, &begin), Refusal::State);
    line.with(|rig| rig.exchange.report.status &= !controller::GENERATOR_BUSY);
    let kind =
        line.with(|rig| core::mem::replace(&mut rig.exchange.command.command[0], CommandKind::Trajectory.word()));
    assert_eq!(refused(&mut client, &begin), Refusal::State);
    line.with(|rig| rig.exchange.command.command[0] = kind);
    let words = bytes(&wave(1e-6, 5.0).to_words());
    done(&mut client, &Request::Wave { action: WaveAction::Start, words: Bytes(&words) });
    assert_eq!(refused(&mut client, &begin), Refusal::State);
    untouched(&line, "busy");
    line.with(|rig| rig.exchange.source.wave = None);
    line.with(|rig| rig.exchange.lockstep = Some(specgen_link::Silence::new(1000)));
    assert_eq!(refused(&mut client, &begin), Refusal::State);
    line.with(|rig| rig.exchange.lockstep = None);
    let number = [0; KNOT];
    // No pass, and one that has no room.
    let none = PassAction::Begin { spacing: 0, before: 0, ticks: 100, trajectory: 0 };
    let long = PassAction::Begin { spacing: 1, before: 0, ticks: KNOTS_OF_A_PASS as u32 + 1, trajectory: 0 };
    for action in [none, long] {
        assert_eq!(refused(&mut client, &Request::Pass { action }), Refusal::Word { index: 0 });
    }
    let whole: Vec<u8> = vec![0; KNOT * (KNOTS + 1)];
    let (first, length) = (KNOTS_OF_A_PASS as u32, Refusal::Length { expected: (KNOTS * KNOT / 8) as u16 });
    for (first, knots, refusal) in
        [(0, &whole[..], length), (0, &whole[..KNOT + 1], length), (first, &whole[..KNOT], Refusal::Word { index: 0 })]
    {
        assert_eq!(refused(&mut client, &Request::Knots { first, knots: Bytes(knots) }), refusal);
    }
    untouched(&line, "refused");
    assert_eq!(pass(&mut client, BEGIN).stage, Stage::Running.word());
    // Without memory there are none.
    line.with(|rig| rig.exchange.source.player = None);
    for request in [begin, Request::Errors { offset: 0 }, Request::Knots { first: 0, knots: Bytes(&number) }] {
        assert_eq!(refused(&mut client, &request), Refusal::Unsupported);
    }
}

/// By a host, by one that comes anew, and by a machine that does not run any more.
#[test]
fn a_pass_that_is_ended_corrects_nothing_from_the_next_tick_on() {
    let abort: &dyn Fn(&Line, &mut Client<Line>) = &|_, client| {
        assert_eq!(pass(client, PassAction::Abort).stage, Stage::Aborted.word());
    };
    let anew: &dyn Fn(&Line, &mut Client<Line>) = &|line, _| {
        line.client(3);
    };
    let hold: &dyn Fn(&Line, &mut Client<Line>) = &|line, client| {
        done(client, &Request::Supervise { request: 3 });
        line.tick(1);
        assert_ne!(line.phase(), Phase::Running);
    };
    for end in [abort, anew, hold] {
        let (line, mut client) = ready();
        put(&mut client, 0, &[knot(7); KNOTS_PLAYED]);
        line.with(|rig| rig.pace = 0);
        pass(&mut client, BEGIN);
        line.tick(25);
        assert_ne!(given(&line).0, [0.0; 6]);
        end(&line, &mut client);
        assert_eq!((stage(&line), given(&line).0), (Stage::Aborted, [0.0; 6]));
        assert!(!line.with(|rig| rig.exchange.source.is_engaged()));
        line.tick(100);
        assert_eq!((stage(&line), given(&line).0), (Stage::Aborted, [0.0; 6]));
        assert!(line.with(|rig| rig.exchange.source.player.as_ref().unwrap().errors().len()) < KNOTS_PLAYED);
    }
}

/// What a host is told while the background has the player.
fn in_the_background(exchange: &mut Exchange, machine: &mut Machine) {
    assert!(exchange.source.player.is_none());
    ask(exchange, machine, Request::Pass { action: PassAction::Look }, |reply| {
        let Reply::Pass(status) = reply else { unreachable!("{reply:?}") };
        assert_eq!((status.stage, status.knots), (Stage::Learning.word(), 0));
        assert_eq!(status.capacity, KNOTS_OF_A_PASS as u32);
    });
    let number = [0; KNOT];
    let requests = [
        Request::Pass { action: BEGIN },
        Request::Pass { action: PassAction::Learn { reach: 0, fade: [0; 2] } },
        Request::Knots { first: 0, knots: Bytes(&number) },
        Request::Errors { offset: 0 },
        Request::Correction { offset: 0 },
    ];
    for request in requests {
        ask(exchange, machine, request, |reply| assert_eq!(reply, Reply::Refused(Refusal::State), "{request:?}"));
    }
}

/// A player with nothing to learn, or in its pass, stays where the tick finds it.
fn looks_only(rig: &mut Rig) {
    let mut looks = 0;
    learn(&mut |action| {
        action(&mut rig.exchange, rig.board.machine_mut());
        assert!(rig.exchange.source.player.is_some());
        looks += 1;
    });
    assert_eq!(looks, 1);
}

/// A plan that adds the error of each knot to its correction, axis by axis.
fn plan() -> Vec<Knot> {
    let bits = |value: f32| value.to_bits() as i32;
    let unit = |axis: usize| core::array::from_fn(|other| bits(if other == axis { 1.0 } else { 0.0 }));
    let mut rows: Vec<Knot> = (0..HEAD).map(|row| unit(row % 6)).collect();
    rows.push([bits(1.0); 6]);
    rows.push([bits(1.0), 0, 0, 0, 0, 0]);
    assert_eq!(rows.len(), plan_rows(0));
    rows
}

#[test]
fn the_background_learns_between_passes_and_says_so_meanwhile() {
    let (line, mut client) = ready();
    let table: Vec<Knot> = (0..KNOTS_PLAYED).map(knot).collect();
    put(&mut client, 0, &[table.clone(), plan()].concat());
    pass(&mut client, BEGIN);
    let learning = PassAction::Learn { reach: 0, fade: [1, 2] };
    assert_eq!(refused(&mut client, &Request::Pass { action: learning }), Refusal::State, "it is under way");
    line.with(looks_only);
    wait(&line, &mut client, "the end of the pass", |line| stage(line) == Stage::Complete);
    let errors = line.with(|rig| rig.exchange.source.player.as_ref().unwrap().errors().to_vec());
    line.with(|rig| (rig.pace, rig.busy) = (0, true));
    assert_eq!(pass(&mut client, learning).stage, Stage::Learning.word());
    assert_eq!(refused(&mut client, &Request::Pass { action: BEGIN }), Refusal::State);
    // Two steps at a time; the host hears meanwhile that it learns.
    let mut rounds = 0;
    let looks = Cell::new(0_u32);
    while stage(&line) == Stage::Learning {
        line.with(|rig| {
            learn(&mut |action| {
                looks.set(looks.get() + 1);
                if looks.get().is_multiple_of(2) {
                    in_the_background(&mut rig.exchange, rig.board.machine_mut());
                }
                action(&mut rig.exchange, rig.board.machine_mut());
            });
        });
        rounds += 1;
        assert!(rounds < 10_000);
    }
    assert_eq!(looks.get(), 2 * rounds);
    // As many steps as knots to modes, modes of knots, and back.
    assert!(rounds >= 4 * KNOTS_PLAYED as u32, "{rounds}");
    assert_eq!(stage(&line), Stage::Complete);
    let learned = knots(&client.fetch(|offset| Request::Correction { offset }).unwrap());
    let inner = 2..KNOTS_PLAYED - 3;
    for index in inner {
        for axis in 0..6 {
            let expected = table[index][axis] + errors[index][axis];
            // Sums of `f32`.
            let near = 1 + expected.abs() / 1_000_000;
            assert!((learned[index][axis] - expected).abs() <= near, "knot {index}, axis {axis}: {learned:?}");
        }
    }
    // Nothing is left to do.
    line.with(looks_only);
    // What it learned from is gone.
    assert_eq!(refused(&mut client, &Request::Pass { action: learning }), Refusal::State);
}
