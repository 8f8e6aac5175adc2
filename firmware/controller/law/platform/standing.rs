//! How the law begins, works and stands still under the supervisor.

use crate::machine::{Supervisor, compares, move_codes};
pub(crate) use crate::sensing::faults;
use crate::setpoint::SETPOINTS;
use crate::step::{advance, sense};
use crate::supervision::{READINGS_PER_LEG, SUPERVISION};
use crate::tick::GAUGE_FAULT;
use crate::{Config, LEGS, Real, State, TickInput, kinematics, sensing};
use specgen_runtime::linear::component;
use specgen_runtime::setpoint::{CommandKind, Generator};
use specgen_runtime::supervisor::{Phase, Sample};
use specgen_runtime::{Correction, Damping, Estimate, Integral, NotchState, Transfer};

/// The gauges' words.
#[inline]
pub(crate) fn readings(input: &TickInput) -> &[Real; 6] {
    &input.gauge
}

/// The same, to be replaced.
#[inline]
pub(crate) fn readings_of(input: &mut TickInput) -> &mut [Real; 6] {
    &mut input.gauge
}

/// A tick of the law; its status.
#[inline]
pub(crate) fn run_law(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> u32 {
    advance(config, state, supervisor.oscillation.stage, input.command.kind, input)
}

/// Puts the law where the machine is. No leg moves in the first tick: a mode that begins takes over what is held.
///
/// After arming set-points begin at the measured pose and the estimates at zero; after a hold the last set-point and the
/// estimates stay, and only what feeds back begins anew.
#[cold]
#[inline(never)]
pub(crate) fn begin(_config: &Config, state: &mut State, supervisor: &mut Supervisor, _input: &TickInput) {
    if supervisor.fresh {
        state.generator = Generator::starting_at(&SETPOINTS, &state.pose);
        state.demand = kinematics::leg_displacements(&state.generator.target().pose);
        state.load = [0.0; LEGS];
        state.estimates = [Estimate::new(); 6];
    } else {
        state.generator.stand_still();
    }
    supervisor.fresh = false;
    state.mode = None;
    state.integral = Integral::new();
    state.error_notch = NotchState::new();
    state.innovation_notch = NotchState::new();
    state.damping = Damping::new();
    state.correction = Correction::new();
    state.error = [0.0; 6];
    state.deflection = [0.0; 6];
    state.transfer = Transfer::new();
    state.limited = false;
    for leg in &mut state.legs {
        leg.excess = 0.0;
    }
}

/// The channel whose turn it is, after the law has seen the readings.
#[inline]
pub(crate) fn look(
    state: &State,
    supervisor: &mut Supervisor,
    input: &TickInput,
    channel: usize,
    expected: Real,
    target: Real,
) {
    let error = target - component(&state.pose, channel);
    supervisor.look(&SUPERVISION, channel, &sample(&input.gauge, channel, expected, Some(error)));
    let given = state.correction.pose().map(|correction| component(&correction, channel));
    supervisor.follow(&SUPERVISION, channel, error, target, given);
}

/// Brings a motion that was under way to rest where the law is to be suspended: the status; none where nothing moves.
#[inline]
pub(crate) fn come_to_rest(
    config: &Config,
    state: &mut State,
    supervisor: &mut Supervisor,
    input: &TickInput,
) -> Option<u32> {
    let suspended = matches!(supervisor.phase, Phase::Holding | Phase::RampingDown);
    (suspended && state.generator.can_stop()).then(|| stop(config, state, supervisor, input))
}

/// A motion that was under way when the law was to be suspended, brought to rest by it within the limits of stops. Returns
/// the status.
#[cold]
#[inline(never)]
fn stop(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> u32 {
    let faults = advance(config, state, supervisor.oscillation.stage, CommandKind::Hold, input) & GAUGE_FAULT;
    supervisor.see(faults >> 8, 0, &input.gauge, &[0; LEGS], 1);
    faults
}

/// Codes held or on their way to rest, the law suspended; pose and rate are still measured. Returns the status.
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
    for leg in &mut state.legs {
        leg.requested = leg.memory.displacement();
    }
    let faults = sense(config, state, &input.gauge);
    if faults == 0 {
        if compares(supervisor) {
            supervisor.look(&SUPERVISION, channel, &sample(&input.gauge, channel, expected, None));
        }
        supervisor.check(&SUPERVISION, &READINGS_PER_LEG, &sensing::readings(&input.gauge), config.code_limits());
    }
    if !supervisor.phase.is_powered() {
        // What it knew of a load ends with the run: arming begins without.
        state.load = [0.0; LEGS];
    }
    supervisor.see(faults, 0, &input.gauge, &[0; LEGS], 1);
    faults << 8
}

/// What a gauge ought to read by the codes sent over the interval that has ended and the known load, m; and the set-point
/// of the axis of that number, m or rad.
#[inline]
pub(crate) fn expectation(state: &State, channel: usize) -> (Real, Real) {
    let Some([a, b, c, d, e, f]) = READINGS_PER_LEG.get(channel) else { return (0.0, 0.0) };
    let legs = &state.legs;
    let load = &state.load;
    let displaced = |leg: usize| legs[leg].memory.displacement() - load[leg];
    let half = *a * displaced(0) + *b * displaced(1) + *c * displaced(2);
    let expected = half + *d * displaced(3) + *e * displaced(4) + *f * displaced(5);
    (expected, component(&state.generator.target().pose, channel))
}

#[inline]
fn sample(gauge: &[Real; 6], channel: usize, expected: Real, error: Option<Real>) -> Sample<Real> {
    Sample { word: component(gauge, channel), reading: component(&sensing::readings(gauge), channel), expected, error }
}
