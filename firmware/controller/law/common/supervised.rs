//! The control law under its supervisor: what every target calls.

pub use crate::machine_words::{
    MACHINE_INPUT_NAMES, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_NAMES, MACHINE_OUTPUT_WORDS, machine_output_words,
};
pub use specgen_runtime::supervisor::{CONVERTER, Cause, INTEGRITY, LINK_LOST, MISSED_TICK, Phase, Request, STOP};

use crate::hysteresis::TABLES;
use crate::limits::DAC;
use crate::standing::{begin, come_to_rest, expectation, look, readings, run_law, stand};
use crate::step::{GAUGE_FAULT, LEG_LIMITED, outputs};
use crate::supervision::SUPERVISION;
use crate::{Config, LEGS, Real, State, TickInput, TickOutput};
use specgen_runtime::supervisor::toward;
use specgen_runtime::{Digest, Real as _, Snapshot as _, supervisor};

/// State of the supervisor in this controller's arithmetic.
pub type Supervisor = supervisor::Supervisor<Real>;

/// Everything that is remembered from tick to tick. No NaN or infinity is ever stored here.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    /// State of the control law.
    pub state: State,
    /// Phase, cause and what the supervisor watches.
    pub supervisor: Supervisor,
}

impl Default for Machine {
    fn default() -> Self {
        Self::new()
    }
}

impl Machine {
    /// Reset: disarmed, and [`State::new`].
    #[must_use]
    pub const fn new() -> Self {
        Self { state: State::new(), supervisor: Supervisor::new() }
    }

    /// Fingerprint of everything that later ticks depend on.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        digest.word(self.state.digest());
        self.supervisor.digest(&mut digest);
        digest.finish()
    }
}

/// What a tick reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineInput {
    /// Command and readings, as the control law takes them.
    pub tick: TickInput,
    /// What is wanted of the supervisor; it holds for as long as it is given.
    pub request: Request,
    /// What the target noticed since the last tick: [`MISSED_TICK`], [`LINK_LOST`], [`INTEGRITY`], [`CONVERTER`], [`STOP`].
    pub events: u32,
}

/// What a tick yields. Every number is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineOutput {
    /// Codes and voltages that go out, and the status of the control law where it ran.
    pub tick: TickOutput,
    /// What the machine does over the coming interval.
    pub phase: Phase,
    /// Why, if it was forced upon it.
    pub cause: Cause,
    /// Whether the amplifiers are to be on over the coming interval.
    pub amplifier_on: bool,
}

/// One supervised tick.
///
/// What events and request say acts in this tick; what the readings show acts in the next one, after the law has seen
/// them.
pub fn supervise(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
    let Machine { state, supervisor } = machine;
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
    // Of the state and at the end: what is as large as an output is slow to move.
    MachineOutput { tick: outputs(state, status), phase, cause, amplifier_on: phase.is_powered() }
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

/// Codes held, or on their way to rest; the memories follow what is really sent.
pub(crate) fn move_codes(config: &Config, state: &mut State, supervisor: &mut Supervisor) {
    let step = supervisor.step_to_rest(&SUPERVISION, config.code_limits().max_step);
    for (leg, table) in state.legs.iter_mut().zip(&TABLES) {
        leg.code = toward(leg.code, SUPERVISION.rest, step);
        leg.memory.apply(table, DAC.drive(leg.code));
    }
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

/// Whether gauges are compared with the model although the law does not run: the codes must stand still.
#[inline]
pub(crate) fn compares(phase: Phase) -> bool {
    matches!(phase, Phase::Arming | Phase::Holding)
}

/// An entry, zero where there is none.
#[inline]
pub(crate) fn component(vector: &[Real; 6], index: usize) -> Real {
    match vector.get(index) {
        Some(value) => *value,
        None => Real::ZERO,
    }
}
