//! The control law under its supervisor: what every target calls.

use specgen_runtime::supervisor::{Phase, Supervisor, toward};

use crate::machine::{Machine, MachineInput, MachineOutput, moved};
use crate::memory::LegMemory as _;
use crate::spec::{ConfigOf, ControlLaw as _, InputOf, Spec, StateOf};
use crate::status::{GAUGE_FAULT, LEG_LIMITED};

/// One supervised tick.
///
/// What events and request say acts in this tick; what the readings show acts in the next one, after the law has seen
/// them.
#[inline]
pub fn supervise<P: Spec>(
    p: P,
    config: &ConfigOf<P>,
    machine: &mut Machine<P>,
    input: &MachineInput<P>,
) -> MachineOutput<P> {
    let Machine { state, supervisor } = machine;
    let sifted;
    let input = if supervisor.accepts(p.supervision(), P::Law::readings(&input.tick)) {
        input
    } else {
        sifted = sift(p, supervisor, input);
        &sifted
    };
    let at_rest =
        supervisor.phase != Phase::Running && P::Law::codes(state).iter().all(|code| *code == p.supervision().rest);
    let enters = supervisor.decide(p.supervision(), input.request, input.events, at_rest);
    if enters {
        P::Law::enter_running(p, config, state, supervisor, &input.tick);
    }
    let channel = supervisor.watch.take_turn();
    let (expected, target) = P::Law::expected_reading(p, state, channel);
    let (phase, cause) = (supervisor.phase, supervisor.cause);
    let status = if phase == Phase::Running {
        run(p, config, state, supervisor, &input.tick, channel, [expected, target])
    } else if let Some(status) = P::Law::decelerate(p, config, state, supervisor, &input.tick) {
        status
    } else {
        P::Law::hold(p, config, state, supervisor, &input.tick, channel, expected)
    };
    let lines = P::Law::fire_triggers(p, config, state, phase, &input.tick, status);
    let status = status | lines | supervisor.sift.status();
    if status & GAUGE_FAULT != 0 {
        supervisor.sift.forget();
    }
    // Of the state and at the end: what is as large as an output is slow to move.
    let finding = supervisor.finding();
    MachineOutput { tick: P::Law::outputs(p, state, status), phase, cause, amplifier_on: phase.is_powered(), finding }
}

/// The input with predictions in place of the words that are not believed.
#[cold]
#[inline(never)]
fn sift<P: Spec>(p: P, supervisor: &mut Supervisor<P::Real>, input: &MachineInput<P>) -> MachineInput<P> {
    let mut sifted = *input;
    supervisor.sift(p.supervision(), P::Law::readings_mut(&mut sifted.tick), |words| P::Law::faults(p, words));
    sifted
}

/// The law at work; returns its status. Of the channel: what is expected, and its target.
#[inline]
fn run<P: Spec>(
    p: P,
    config: &ConfigOf<P>,
    state: &mut StateOf<P>,
    supervisor: &mut Supervisor<P::Real>,
    input: &InputOf<P>,
    channel: usize,
    expected: [P::Real; 2],
) -> u32 {
    let before = P::Law::codes(state);
    let status = P::Law::run(p, config, state, supervisor, input);
    if status & GAUGE_FAULT == 0 {
        P::Law::check_tracking(p, state, supervisor, input, channel, expected);
    }
    if status & (GAUGE_FAULT | LEG_LIMITED) == 0 {
        supervisor.seen = 0;
    } else {
        let (faults, limited) = ((status & GAUGE_FAULT) >> 8, status & LEG_LIMITED);
        let moved = moved(&before, P::Law::codes(state));
        supervisor.see(faults, limited, P::Law::readings(input), &moved, P::Law::code_limits(config).max_step);
    }
    status
}

/// Codes held, on their way to rest, or in the pulse of the wiring check; the memories follow what is really sent.
pub(crate) fn move_codes<'a, P: Spec>(
    p: P,
    max_step: i32,
    supervisor: &mut Supervisor<P::Real>,
    legs: impl Iterator<Item = (&'a mut i32, &'a mut P::Memory)>,
) where
    P::Memory: 'a,
{
    let step = supervisor.step_to_rest(p.supervision(), max_step);
    for ((index, (code, memory)), table) in legs.enumerate().zip(p.tables()) {
        *code = toward(*code, supervisor.goal(p.supervision(), index), step);
        memory.apply(table, p.dac().drive(*code));
    }
}

/// Whether gauges are compared with the model although the law does not run: the codes must stand still.
#[inline]
pub(crate) fn compares<P: Spec>(p: P, supervisor: &Supervisor<P::Real>) -> bool {
    matches!(supervisor.phase, Phase::Arming | Phase::Holding) && !supervisor.is_checking(p.supervision())
}
