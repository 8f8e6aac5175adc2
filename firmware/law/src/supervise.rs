//! A tick of the control law: alone, and under its supervisor, as every target calls it.

use specgen_runtime::CodeLimits;
use specgen_runtime::linear::{component, each};
use specgen_runtime::sensing::faults;
use specgen_runtime::supervisor::{Cause, Fallback, Phase, Request, Sample, Supervisor, toward};

use crate::machine::{MachineInput, MachineOutput};
use crate::memory::LegMemory as _;
use crate::spec::{
    Config, ControlLaw as _, Input as _, InputOf, LEGS, Machine, Settings as _, Spec, StateOf, TickOutput,
};
use crate::status::{GAUGE_FAULT, LEG_LIMITED};

/// One tick of the law alone. See the module of the law's step for the timing.
pub fn step<P: Spec>(p: P, config: &Config<P>, state: &mut StateOf<P>, input: &InputOf<P>) -> TickOutput<P> {
    let status = P::Law::advance(p, config, state, Fallback::None, input);
    outputs(p, state, status)
}

/// Outputs of a tick, from the state after it.
#[inline]
fn outputs<P: Spec>(p: P, state: &StateOf<P>, status: u32) -> TickOutput<P> {
    let dac_code = P::Law::codes(state);
    TickOutput { voltage: each(|leg| p.dac().voltage(dac_code[leg])), dac_code, status }
}

/// One supervised tick.
///
/// Events and the request act in this tick. Readings act in the next one, after the law has seen them.
#[inline]
pub fn supervise<P: Spec>(
    p: P,
    config: &Config<P>,
    machine: &mut Machine<P>,
    input: &MachineInput<P>,
) -> MachineOutput<P> {
    let sifted;
    let input = if machine.supervisor.accepts(p.supervision(), input.tick.gauges()) {
        input
    } else {
        sifted = sift(p, &mut machine.supervisor, input);
        &sifted
    };
    let Machine { state, supervisor } = machine;
    let at_rest =
        supervisor.phase != Phase::Running && P::Law::codes(state).iter().all(|code| *code == p.supervision().rest);
    let is_refused = !p.is_identified() && input.request == Request::Run;
    let request = match (input.request, supervisor.phase) {
        (Request::Drive, Phase::Holding) if !P::Law::may_drive(p, state) => Request::Hold,
        // A hold would end the wiring check.
        (Request::Run, Phase::Arming) if is_refused => Request::None,
        (Request::Run, _) if is_refused => Request::Hold,
        (request, _) => request,
    };
    let enters = supervisor.decide(p.supervision(), request, input.events, at_rest);
    if enters {
        P::Law::enter_running(p, config, machine, &input.tick);
    }
    let channel = machine.supervisor.watch.take_turn();
    let (expected, target) = P::Law::expected_reading(p, &machine.state, channel);
    let (phase, cause) = (machine.supervisor.phase, machine.supervisor.cause);
    let status = if !p.is_identified() {
        // Whatever the state.
        hold(p, config, machine, &input.tick, channel, expected)
    } else if phase == Phase::Running {
        run(p, config, machine, &input.tick, channel, [expected, target])
    } else if let Some(status) = P::Law::decelerate(p, config, machine, &input.tick) {
        status
    } else {
        hold(p, config, machine, &input.tick, channel, expected)
    };
    let Machine { state, supervisor } = machine;
    let lines = P::Law::fire_triggers(config, state, phase, &input.tick, status);
    let status = status | lines | supervisor.sift.status();
    if status & GAUGE_FAULT != 0 {
        supervisor.sift.forget();
    }
    // Written into the state's place at the end: a large output is slow to move.
    let finding = supervisor.finding();
    // Not part of the state: it lasts as long as the request.
    let cause = match cause {
        Cause::None if is_refused && phase == Phase::Holding => Cause::NotIdentified,
        cause => cause,
    };
    MachineOutput { tick: outputs(p, state, status), phase, cause, amplifier_on: phase.is_powered(), finding }
}

/// The input with predictions in place of invalid words.
#[cold]
#[inline(never)]
fn sift<P: Spec>(p: P, supervisor: &mut Supervisor<P::Real>, input: &MachineInput<P>) -> MachineInput<P> {
    let mut sifted = *input;
    supervisor.sift(p.supervision(), sifted.tick.gauges_mut(), |words| faults(words, p.raw_limits()));
    sifted
}

/// The law runs; returns its status. `expected` and `target`: expected reading and set-point of `channel`.
#[inline]
fn run<P: Spec>(
    p: P,
    config: &Config<P>,
    machine: &mut Machine<P>,
    input: &InputOf<P>,
    channel: usize,
    [expected, target]: [P::Real; 2],
) -> u32 {
    let before = P::Law::codes(&machine.state);
    let status = P::Law::run(p, config, machine, input);
    let Machine { state, supervisor } = machine;
    if status & GAUGE_FAULT == 0 {
        let sample = sample(p, input, channel, expected);
        let (reached, given) = P::Law::reached(state, channel, sample.reading);
        let error = target - reached;
        supervisor.look(p.supervision(), channel, &Sample { error: Some(error), ..sample });
        supervisor.follow(p.supervision(), channel, error, target, given);
    }
    if status & (GAUGE_FAULT | LEG_LIMITED) == 0 {
        supervisor.seen = 0;
    } else {
        let (faults, limited) = ((status & GAUGE_FAULT) >> 8, status & LEG_LIMITED);
        let moved = moved(&before, P::Law::codes(state));
        supervisor.see(faults, limited, input.gauges(), &moved, config.code_limits().max_step);
    }
    status
}

/// Codes held, driven or ramping to rest, the law suspended. Returns the status.
#[cold]
#[inline(never)]
fn hold<P: Spec>(
    p: P,
    config: &Config<P>,
    machine: &mut Machine<P>,
    input: &InputOf<P>,
    channel: usize,
    expected: P::Real,
) -> u32 {
    let limits = config.code_limits();
    let (before, pose) = (P::Law::codes(&machine.state), P::Law::pose(&machine.state));
    let drives = machine.supervisor.phase == Phase::Driving;
    let limited = move_codes(p, limits, machine, drives.then(|| P::Law::voltages(input)));
    let faults = P::Law::hold(p, config, machine, input);
    let Machine { state, supervisor } = machine;
    if faults == 0 {
        // Gauges are compared with the model only while the codes are constant.
        let compares = matches!(supervisor.phase, Phase::Arming | Phase::Holding);
        if compares && !supervisor.is_checking(p.supervision()) || drives {
            let sample = sample(p, input, channel, expected);
            // The model of a leg that was not identified may be wrong, but a gauge must not be stuck.
            let reading = if drives || !p.is_identified() { expected } else { sample.reading };
            supervisor.look(p.supervision(), channel, &Sample { reading, ..sample });
        }
        let readings = P::Law::readings(p, input.gauges());
        supervisor.check(p.supervision(), p.readings_per_leg(), &readings, limits);
    }
    let moved = moved(&before, P::Law::codes(state));
    supervisor.see(faults, limited & LEG_LIMITED, input.gauges(), &moved, limits.max_step);
    if drives && P::Law::is_near_end(p, state, &pose) {
        supervisor.see_end_of_workspace();
    }
    limited | faults << 8
}

/// Codes held, ramping to rest, or in the pulse of the wiring check; in an open drive those of the `voltages` commanded,
/// within their limits. The memories follow the codes. Returns the status: bits of the legs that a limit held back, or that
/// of a refused command.
fn move_codes<P: Spec>(
    p: P,
    limits: CodeLimits,
    machine: &mut Machine<P>,
    voltages: Option<Result<&[P::Real; LEGS], u32>>,
) -> u32 {
    let Machine { state, supervisor } = machine;
    let step = supervisor.step_to_rest(p.supervision(), limits.max_step);
    let mut status = 0;
    for ((index, (code, memory)), table) in P::Law::drives(state).enumerate().zip(p.tables()) {
        match voltages {
            None => *code = toward(*code, supervisor.goal(p.supervision(), index), step),
            Some(Ok(voltages)) => {
                let (permitted, held_back) = p.dac().code_of_voltage(component(voltages, index), *code, limits);
                *code = permitted;
                status |= (held_back as u32) << index;
            }
            Some(Err(refusal)) => status = refusal,
        }
        memory.apply(table, p.dac().drive(*code));
    }
    status
}

/// Sample of a gauge, without an error of the law.
#[inline]
fn sample<P: Spec>(p: P, input: &InputOf<P>, channel: usize, expected: P::Real) -> Sample<P::Real> {
    let reading = component(&P::Law::readings(p, input.gauges()), channel);
    Sample { word: component(input.gauges(), channel), reading, expected, error: None }
}

/// Code steps of each leg.
#[cold]
fn moved(before: &[i32; LEGS], mut codes: [i32; LEGS]) -> [i32; LEGS] {
    for (code, before) in codes.iter_mut().zip(before) {
        *code -= *before;
    }
    codes
}
