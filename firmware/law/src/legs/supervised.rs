//! How the law begins, works and stands still under the supervisor.

use specgen_runtime::linear::component;
use specgen_runtime::snapshot::Writer;
use specgen_runtime::supervisor::{Phase, Sample, Supervisor};
use specgen_runtime::{CodeLimits, Estimate, Law, Real as _, SetpointKind};

use super::config::{Config, Settings};
use super::constants::{LegSpace, SixLegs};
use super::lead::DeadTimeLead as _;
use super::sensing::{faults, gauge_is_accepted, leg_setpoint_is_accepted};
use super::state::{LegState, State};
use super::step::{advance, outputs};
use super::tick::{TickInput, TickOutput, write_output};
use crate::kinematics::{pose_from_legs, pose_is_accepted};
use crate::memory::LegMemory as _;
use crate::spec::{ControlLaw, LEGS, Reset};
use crate::supervise::{compares, move_codes};

impl<P: SixLegs> ControlLaw<P> for LegSpace {
    type Config = Config<P>;
    type Settings = Settings<P>;
    type State = State<P>;
    type Input = TickInput<P>;
    type Output = TickOutput<P>;

    fn at_reset(reset: &Reset<P>) -> State<P> {
        State::new(reset)
    }

    #[inline]
    fn code_limits(config: &Config<P>) -> CodeLimits {
        config.code_limits()
    }

    #[inline]
    fn codes(state: &State<P>) -> [i32; LEGS] {
        let [a, b, c, d, e, f] = &state.legs;
        [a.code, b.code, c.code, d.code, e.code, f.code]
    }

    #[inline]
    fn readings(input: &TickInput<P>) -> &[P::Real; 6] {
        &input.displacement
    }

    #[inline]
    fn readings_mut(input: &mut TickInput<P>) -> &mut [P::Real; 6] {
        &mut input.displacement
    }

    #[inline]
    fn faults(p: P, readings: &[P::Real; 6]) -> u32 {
        faults(p, readings)
    }

    /// What a leg ought to show by the code sent, and the demand on it, m.
    #[inline]
    fn expected_reading(_p: P, state: &State<P>, channel: usize) -> (P::Real, P::Real) {
        match state.legs.get(channel) {
            Some(leg) => (leg.memory.displacement(), component(&state.demand, channel)),
            None => (P::Real::ZERO, P::Real::ZERO),
        }
    }

    /// The demand on a leg is where its gauge shows it, and its level estimate is what the model lacks to that, so that the code held
    /// stays what the law asks for. Without adaptation, or where the gauge is not believed, the demand is where the model has the leg.
    /// From there the demand goes to the set-point that is given.
    #[cold]
    #[inline(never)]
    fn enter_running(
        p: P,
        config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
    ) {
        let State { legs, demand, ticks_in_run } = state;
        *ticks_in_run = 0;
        for ((leg, demand), reading) in legs.iter_mut().zip(demand.iter_mut()).zip(&input.displacement) {
            let modelled = leg.memory.displacement();
            let adapts = config.law() != Law::Invhys && gauge_is_accepted(p, *reading);
            *demand = if adapts { *reading } else { modelled };
            leg.estimate = Estimate { level: *demand - modelled, drift: P::Real::ZERO };
            leg.lead.rest();
        }
        supervisor.fresh = false;
        supervisor.approach.begin(match config.setpoint() {
            SetpointKind::Pose => pose_from_legs(p, demand),
            SetpointKind::Leg => *demand,
        });
    }

    #[inline]
    fn run(
        p: P,
        config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
    ) -> u32 {
        let approached;
        let given = if supervisor.approach.is_done() {
            input
        } else {
            approached = approaching(p, config, supervisor, input);
            &approached
        };
        advance(p, config, state, supervisor.oscillation.stage, given)
    }

    #[inline]
    fn check_tracking(
        p: P,
        _state: &State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
        channel: usize,
        [expected, target]: [P::Real; 2],
    ) {
        let reading = component(&input.displacement, channel);
        let error = target - reading;
        let sample = Sample { word: reading, reading, expected, error: Some(error) };
        supervisor.look(p.supervision(), channel, &sample);
        supervisor.follow(p.supervision(), channel, error, target, None);
    }

    /// Legs have no rate that would have to be brought to rest.
    #[inline]
    fn decelerate(
        _p: P,
        _config: &Config<P>,
        _state: &mut State<P>,
        _supervisor: &mut Supervisor<P::Real>,
        _input: &TickInput<P>,
    ) -> Option<u32> {
        None
    }

    #[cold]
    #[inline(never)]
    fn hold(
        p: P,
        config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
        channel: usize,
        expected: P::Real,
    ) -> u32 {
        let legs = state.legs.iter_mut().map(|LegState { code, memory, .. }| (code, memory));
        move_codes(p, config.code_limits().max_step, supervisor, legs);
        let faults = faults(p, &input.displacement);
        for leg in &mut state.legs {
            leg.lead.rest();
        }
        if faults == 0 {
            if compares(p, supervisor) {
                let reading = component(&input.displacement, channel);
                let sample = Sample { word: reading, reading, expected, error: None };
                supervisor.look(p.supervision(), channel, &sample);
            }
            supervisor.check(p.supervision(), p.readings_per_leg(), &input.displacement, config.code_limits());
        }
        supervisor.see(faults, 0, &input.displacement, &[0; LEGS], 1);
        faults << 8
    }

    /// Six legs, which have no pose, have no output lines.
    #[inline]
    fn fire_triggers(
        _p: P,
        _config: &Config<P>,
        _state: &mut State<P>,
        _phase: Phase,
        _input: &TickInput<P>,
        _status: u32,
    ) -> u32 {
        0
    }

    #[inline]
    fn outputs(p: P, state: &State<P>, status: u32) -> TickOutput<P> {
        outputs(p, state, status)
    }

    fn read_input(_p: P, words: &[u64]) -> TickInput<P> {
        TickInput::read(words)
    }

    fn measured(_p: P, command: &[u64], gauge: &[P::Real; 6], _wrench: &[P::Real; 6]) -> TickInput<P> {
        TickInput::of_command(command, gauge)
    }

    fn save_input(input: &TickInput<P>, words: &mut Writer<'_>) {
        input.save(words);
    }

    fn write_output(_p: P, output: &TickOutput<P>, _state: &State<P>, words: &mut [u64]) {
        write_output(output, words);
    }

    #[inline]
    fn codes_and_status(output: &TickOutput<P>) -> ([i32; LEGS], u32) {
        (output.dac_code, output.status)
    }
}

/// The tick with the set-point that the law is given on its way to the one that is asked for.
#[cold]
#[inline(never)]
fn approaching<P: SixLegs>(
    p: P,
    config: &Config<P>,
    supervisor: &mut Supervisor<P::Real>,
    input: &TickInput<P>,
) -> TickInput<P> {
    let accepted = match config.setpoint() {
        SetpointKind::Pose => pose_is_accepted(p, &input.setpoint),
        SetpointKind::Leg => leg_setpoint_is_accepted(p, &input.setpoint),
    };
    let (keep, negligible) = (p.approach_keep(), p.approach_negligible());
    let setpoint = supervisor.approach.setpoint(&input.setpoint, accepted, keep, negligible);
    TickInput { setpoint, displacement: input.displacement }
}
