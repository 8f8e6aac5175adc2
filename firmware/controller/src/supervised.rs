// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! The control law under its supervisor: what every target calls.

pub use crate::machine::{
    MACHINE_INPUT_NAMES, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_NAMES, MACHINE_OUTPUT_WORDS, Machine, MachineInput,
    MachineOutput, Supervisor, machine_output_words,
};
pub use specgen_runtime::supervisor::{
    AMPLIFIER, CONVERTER, Cause, Fallback, Finding, INTEGRITY, LINK_LOST, MISSED_TICK, Phase, Request, SAMPLE_REPEATED,
    SAMPLE_REPLACED, STALLED, STOP,
};

use crate::standing::{begin, come_to_rest, expectation, faults, look, readings, readings_of, run_law, stand};
use crate::step::outputs;
use crate::supervision::SUPERVISION;
use crate::tick::{GAUGE_FAULT, LEG_LIMITED};
use crate::triggers::act;
use crate::{Config, LEGS, Real, State, TickInput};

/// One supervised tick.
///
/// What events and request say acts in this tick; what the readings show acts in the next one, after the law has seen
/// them.
pub fn supervise(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
    let Machine { state, supervisor } = machine;
    let sifted;
    let input = if supervisor.accepts(&SUPERVISION, readings(&input.tick)) {
        input
    } else {
        sifted = sift(supervisor, input);
        &sifted
    };
    let at_rest = supervisor.phase != Phase::Running && state.legs.iter().all(|leg| leg.code == SUPERVISION.rest);
    let begins = supervisor.decide(&SUPERVISION, input.request, input.events, at_rest);
    if begins {
        begin(config, state, supervisor, &input.tick);
    }
    let channel = supervisor.watch.take_turn();
    let (expected, target) = expectation(state, channel);
    let (phase, cause) = (supervisor.phase, supervisor.cause);
    let status = if phase == Phase::Running {
        run(config, state, supervisor, &input.tick, channel, [expected, target])
    } else if let Some(status) = come_to_rest(config, state, supervisor, &input.tick) {
        status
    } else {
        stand(config, state, supervisor, &input.tick, channel, expected)
    };
    let status = status | act(config, state, phase, &input.tick, status) | supervisor.sift.status();
    if status & GAUGE_FAULT != 0 {
        supervisor.sift.forget();
    }
    // Of the state and at the end: what is as large as an output is slow to move.
    let finding = supervisor.finding();
    MachineOutput { tick: outputs(state, status), phase, cause, amplifier_on: phase.is_powered(), finding }
}

/// The input with predictions for the words that leapt.
#[cold]
#[inline(never)]
fn sift(supervisor: &mut Supervisor, input: &MachineInput) -> MachineInput {
    let mut sifted = *input;
    supervisor.sift(&SUPERVISION, readings_of(&mut sifted.tick), faults);
    sifted
}

/// The law at work; returns its status. Of the channel: what is `expected`, and its `target`.
#[inline]
fn run(
    config: &Config,
    state: &mut State,
    supervisor: &mut Supervisor,
    input: &TickInput,
    channel: usize,
    [expected, target]: [Real; 2],
) -> u32 {
    let before = codes(state);
    let status = run_law(config, state, supervisor, input);
    if status & GAUGE_FAULT == 0 {
        look(state, supervisor, input, channel, expected, target);
    }
    if status & (GAUGE_FAULT | LEG_LIMITED) == 0 {
        supervisor.seen = 0;
    } else {
        let (faults, limited) = ((status & GAUGE_FAULT) >> 8, status & LEG_LIMITED);
        let moved = moved(state, &before);
        supervisor.see(faults, limited, readings(input), &moved, config.code_limits().max_step);
    }
    status
}

/// Codes held at the outputs.
#[inline]
fn codes(state: &State) -> [i32; LEGS] {
    let [a, b, c, d, e, f] = &state.legs;
    [a.code, b.code, c.code, d.code, e.code, f.code]
}

/// Codes by which each leg moved.
#[cold]
fn moved(state: &State, before: &[i32; LEGS]) -> [i32; LEGS] {
    let mut moved = codes(state);
    for (code, before) in moved.iter_mut().zip(before) {
        *code -= *before;
    }
    moved
}
