//! The law under the supervisor: start, run and hold.

use specgen_runtime::linear::component;
use specgen_runtime::sensing::faults;
use specgen_runtime::supervisor::{Fallback, Supervisor};
use specgen_runtime::{Estimate, Law, Real as _, SetpointKind};

use super::config::Settings;
use super::constants::{LegSpace, SixLegs};
use super::lead::{DeadTimeLead as _, LastChange as _};
use super::state::{LegState, State};
use super::step::{advance, is_accepted};
use super::tick::{TickInput, write_output};
use crate::kinematics::pose_from_legs;
use crate::memory::LegMemory as _;
use crate::spec::{Config, ControlLaw, LEGS, Machine, Reset, TickOutput};

impl<P: SixLegs> ControlLaw<P> for LegSpace {
    type Settings = Settings<P>;
    type State = State<P>;
    type Input = TickInput<P>;

    fn at_reset(reset: &Reset<P>) -> State<P> {
        State::new(reset)
    }

    #[inline]
    fn codes(state: &State<P>) -> [i32; LEGS] {
        let [a, b, c, d, e, f] = &state.legs;
        [a.code, b.code, c.code, d.code, e.code, f.code]
    }

    #[inline]
    fn drives(state: &mut State<P>) -> impl Iterator<Item = (&mut i32, &mut P::Memory)> {
        state.legs.iter_mut().map(|LegState { code, memory, .. }| (code, memory))
    }

    /// Expected reading of a leg by the code sent, and its demand, m.
    #[inline]
    fn expected_reading(_p: P, state: &State<P>, channel: usize) -> (P::Real, P::Real) {
        match state.legs.get(channel) {
            Some(leg) => (leg.memory.displacement(), component(&state.demand, channel)),
            None => (P::Real::ZERO, P::Real::ZERO),
        }
    }

    #[inline]
    fn reached(_state: &State<P>, _channel: usize, reading: P::Real) -> (P::Real, Option<P::Real>) {
        (reading, None)
    }

    #[inline]
    fn advance(p: P, config: &Config<P>, state: &mut State<P>, fallback: Fallback, input: &TickInput<P>) -> u32 {
        advance(p, config, state, fallback, input)
    }

    /// The demand of a leg starts at its gauge reading, and the level estimate at the difference between model and
    /// reading, so that the law requests the present code. Without adaptation, or with an invalid reading, the demand
    /// starts at the model's displacement. From there the demand approaches the set-point.
    #[cold]
    #[inline(never)]
    fn enter_running(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &TickInput<P>) {
        let Machine { state: State { legs, demand, ticks_in_run }, supervisor } = machine;
        *ticks_in_run = 0;
        let faults = faults(&input.displacement, p.raw_limits());
        for (index, ((leg, demand), reading)) in
            legs.iter_mut().zip(demand.iter_mut()).zip(&input.displacement).enumerate()
        {
            let modelled = leg.memory.displacement();
            let adapts = config.law != Law::Invhys && (faults >> index) & 1 == 0;
            *demand = if adapts { *reading } else { modelled };
            leg.estimate = Estimate { level: *demand - modelled, drift: P::Real::ZERO };
            leg.lead.rest();
            leg.change.rest();
        }
        supervisor.fresh = false;
        supervisor.approach.begin(match config.setpoint {
            SetpointKind::Pose => pose_from_legs(p, demand),
            SetpointKind::Leg => *demand,
        });
    }

    #[inline]
    fn run(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &TickInput<P>) -> u32 {
        let Machine { state, supervisor } = machine;
        let approached;
        let given = if supervisor.approach.is_done() {
            input
        } else {
            approached = approaching(p, config, supervisor, input);
            &approached
        };
        advance(p, config, state, supervisor.oscillation.stage, given)
    }

    fn hold(p: P, _config: &Config<P>, machine: &mut Machine<P>, input: &TickInput<P>) -> u32 {
        for leg in &mut machine.state.legs {
            leg.lead.rest();
            leg.change.rest();
        }
        faults(&input.displacement, p.raw_limits())
    }

    fn write_output(p: P, output: &TickOutput<P>, state: &State<P>, words: &mut [u64]) {
        write_output(p, output, state, words);
    }
}

/// The tick with the set-point of the approach.
#[cold]
#[inline(never)]
fn approaching<P: SixLegs>(
    p: P,
    config: &Config<P>,
    supervisor: &mut Supervisor<P::Real>,
    input: &TickInput<P>,
) -> TickInput<P> {
    let accepted = is_accepted(p, config, &input.setpoint);
    let (keep, negligible) = (p.approach_keep(), p.approach_negligible());
    let setpoint = supervisor.approach.setpoint(&input.setpoint, accepted, keep, negligible);
    TickInput { setpoint, ..*input }
}
