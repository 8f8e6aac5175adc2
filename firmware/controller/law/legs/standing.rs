//! How the law begins, works and stands still under the supervisor.

use crate::hysteresis::LED;
use crate::machine::{Supervisor, compares, move_codes};
use crate::sensing::{gauge_is_accepted, leg_setpoint_is_accepted};
use crate::step::advance;
use crate::supervision::{APPROACH_KEEP, APPROACH_NEGLIGIBLE, READINGS_PER_LEG, SUPERVISION};
use crate::{Config, LEGS, Real, SetpointKind, State, TickInput, kinematics};
use specgen_runtime::linear::component;
use specgen_runtime::supervisor::Sample;
use specgen_runtime::{Estimate, Law};

/// The gauges' words.
#[inline]
pub(crate) fn readings(input: &TickInput) -> &[Real; 6] {
    &input.displacement
}

/// The same, to be replaced.
#[inline]
pub(crate) fn readings_of(input: &mut TickInput) -> &mut [Real; 6] {
    &mut input.displacement
}

/// Gauges whose word is not believed: bit k for gauge k.
#[inline]
pub(crate) fn faults(displacements: &[Real; 6]) -> u32 {
    let mut faults = 0;
    for (index, reading) in displacements.iter().enumerate() {
        faults |= (!gauge_is_accepted(*reading) as u32) << index;
    }
    faults
}

/// A tick of the law; its status.
#[inline]
pub(crate) fn run_law(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> u32 {
    let approached;
    let given = if supervisor.approach.is_done() {
        input
    } else {
        approached = approaching(config, supervisor, input);
        &approached
    };
    advance(config, state, supervisor.oscillation.stage, given)
}

/// Legs have no rate that would have to be brought to rest.
#[inline]
pub(crate) fn come_to_rest(
    _config: &Config,
    _state: &mut State,
    _supervisor: &mut Supervisor,
    _input: &TickInput,
) -> Option<u32> {
    None
}

/// Puts the law where the machine is: the demand on a leg is where its gauge shows it, and its level estimate is what the
/// model lacks to that, so that the code held stays what the law asks for. Without adaptation, or where the gauge is not
/// believed, the demand is where the model has the leg. From there the demand goes to the set-point that is given.
#[cold]
#[inline(never)]
pub(crate) fn begin(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) {
    let State { legs, demand, ticks_in_run } = state;
    *ticks_in_run = 0;
    for ((leg, demand), reading) in legs.iter_mut().zip(demand.iter_mut()).zip(&input.displacement) {
        let modelled = leg.memory.displacement();
        let adapts = config.law() != Law::Invhys && gauge_is_accepted(*reading);
        *demand = if adapts { *reading } else { modelled };
        leg.estimate = Estimate { level: *demand - modelled, drift: 0.0 };
        leg.lead = [0.0; LED as usize];
    }
    supervisor.fresh = false;
    supervisor.approach.begin(match config.setpoint() {
        SetpointKind::Pose => kinematics::pose_from_legs(demand),
        SetpointKind::Leg => *demand,
    });
}

/// The tick with the set-point that the law is given on its way to the one that is asked for.
#[cold]
#[inline(never)]
fn approaching(config: &Config, supervisor: &mut Supervisor, input: &TickInput) -> TickInput {
    let accepted = match config.setpoint() {
        SetpointKind::Pose => kinematics::pose_is_accepted(&input.setpoint),
        SetpointKind::Leg => leg_setpoint_is_accepted(&input.setpoint),
    };
    let setpoint = supervisor.approach.setpoint(&input.setpoint, accepted, APPROACH_KEEP, APPROACH_NEGLIGIBLE);
    TickInput { setpoint, displacement: input.displacement }
}

/// The leg whose turn it is, after the law has seen the readings.
#[inline]
pub(crate) fn look(
    _state: &State,
    supervisor: &mut Supervisor,
    input: &TickInput,
    channel: usize,
    expected: Real,
    target: Real,
) {
    let reading = component(&input.displacement, channel);
    let error = target - reading;
    supervisor.look(&SUPERVISION, channel, &Sample { word: reading, reading, expected, error: Some(error) });
    supervisor.follow(&SUPERVISION, channel, error, target, None);
}

/// Codes held or on their way to rest, the law suspended. Returns the status.
#[cold]
#[inline(never)]
pub(crate) fn stand(
    config: &Config,
    state: &mut State,
    supervisor: &mut Supervisor,
    input: &TickInput,
    channel: usize,
    expected: Real,
) -> u32 {
    move_codes(config, state, supervisor);
    let faults = faults(&input.displacement);
    for leg in &mut state.legs {
        leg.lead = [0.0; LED as usize];
    }
    if faults == 0 {
        if compares(supervisor) {
            let reading = component(&input.displacement, channel);
            supervisor.look(&SUPERVISION, channel, &Sample { word: reading, reading, expected, error: None });
        }
        supervisor.check(&SUPERVISION, &READINGS_PER_LEG, &input.displacement, config.code_limits());
    }
    supervisor.see(faults, 0, &input.displacement, &[0; LEGS], 1);
    faults << 8
}

/// What a leg ought to show by the code sent over the interval that has ended, and the demand on it, m.
#[inline]
pub(crate) fn expectation(state: &State, channel: usize) -> (Real, Real) {
    match state.legs.get(channel) {
        Some(leg) => (leg.memory.displacement(), component(&state.demand, channel)),
        None => (0.0, 0.0),
    }
}
