//! Parts of the tick as functions of their own, for measuring what each costs. The tick does not use them.

use specgen_runtime::Real as _;
use specgen_runtime::linear::difference;

use super::config::Config;
use super::constants::Platform;
use super::notch::{modal_error, notch_error};
use super::state::State;
use super::step::{self, actuate, known_load, reaction};
use super::tick::TickInput;
use crate::memory::LegMemory as _;
use crate::spec::{Compiled, LEGS};
use crate::stage::Stage;

/// Number of stages.
pub const STAGE_COUNT: usize = 9;

/// All stages, in the order of the tick.
#[must_use]
pub const fn stages<P: Platform + Compiled>() -> [Stage<P>; STAGE_COUNT] {
    [
        Stage { name: "sense", calls: 1, run: sense::<P> },
        Stage { name: "notch", calls: 1, run: notch::<P> },
        Stage { name: "learn", calls: 1, run: learn::<P> },
        Stage { name: "setpoint", calls: 1, run: setpoint::<P> },
        Stage { name: "dynamics", calls: 1, run: dynamics::<P> },
        Stage { name: "load", calls: 1, run: load::<P> },
        Stage { name: "inverse", calls: LEGS, run: inverse::<P> },
        Stage { name: "actuate", calls: LEGS, run: leg::<P> },
        Stage { name: "limits", calls: LEGS, run: limits::<P> },
    ]
}

/// Brings a copy of the state to where the stages find it, with each leg's request in place of its excess; not measured.
pub fn prepare<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>, input: &TickInput<P>) {
    step::sense(p, config, state, &input.gauge);
    state.generator.tick(p.setpoints(), &input.command);
    let (demand, _) = known_load(p, config, state);
    let reaction = reaction(p, config, state);
    for (index, leg) in state.legs.iter_mut().enumerate() {
        leg.excess = demand[index] + reaction[index];
    }
}

/// Gauges to pose.
extern "C" fn sense<P: Platform + Compiled>(
    config: &Config<P>,
    state: &mut State<P>,
    input: &TickInput<P>,
    _leg: usize,
) {
    step::sense(P::CONSTANTS, config, state, &input.gauge);
}

/// The modal notch on the pose error.
extern "C" fn notch<P: Platform + Compiled>(
    _config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    _leg: usize,
) {
    let error = modal_error(P::CONSTANTS, &difference(&state.generator.target().pose, &state.pose));
    state.error = notch_error(P::CONSTANTS, &mut state.error_notch, &error);
}

/// All that the readings teach: both notches, integral and adaptation.
extern "C" fn learn<P: Platform + Compiled>(
    config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    _leg: usize,
) {
    step::learn(P::CONSTANTS, config, state);
}

/// The generator of set-points.
extern "C" fn setpoint<P: Platform + Compiled>(
    _config: &Config<P>,
    state: &mut State<P>,
    input: &TickInput<P>,
    _leg: usize,
) {
    state.generator.tick(P::CONSTANTS.setpoints(), &input.command);
}

/// h, ḣ, ḧ to six leg forces.
extern "C" fn dynamics<P: Platform + Compiled>(
    _config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    _leg: usize,
) {
    state.error = P::CONSTANTS.body().leg_forces(state.generator.target());
}

/// Motion to leg displacements and to what the legs give way, as the tick takes it.
extern "C" fn load<P: Platform + Compiled>(
    config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    _leg: usize,
) {
    (state.error, state.wrench) = known_load(P::CONSTANTS, config, state);
}

/// Γ⁻¹ of one leg: displacement to drive.
extern "C" fn inverse<P: Platform + Compiled>(
    _config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    leg: usize,
) {
    if let (Some(leg), Some(table)) = (state.legs.get_mut(leg), P::CONSTANTS.tables().get(leg)) {
        leg.excess = leg.memory.solve(table, leg.excess);
    }
}

/// One leg from request to code: Γ⁻¹, converter and limits, and the reversal memory brought up to date.
extern "C" fn leg<P: Platform + Compiled>(config: &Config<P>, state: &mut State<P>, _input: &TickInput<P>, leg: usize) {
    if let (Some(leg), Some(table)) = (state.legs.get_mut(leg), P::CONSTANTS.tables().get(leg)) {
        let request = leg.excess;
        actuate(P::CONSTANTS, config, leg, table, request);
    }
}

/// One leg from drive to code within voltage and slew limits.
extern "C" fn limits<P: Platform + Compiled>(
    config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    leg: usize,
) {
    if let Some(leg) = state.legs.get_mut(leg) {
        let (code, held_back) = P::CONSTANTS.dac().code(leg.excess, leg.code, config.code_limits());
        leg.code = code;
        leg.requested = if held_back { P::Real::ZERO } else { P::CONSTANTS.dac().voltage(code) };
    }
}
