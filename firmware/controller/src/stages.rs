// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Parts of the tick as functions of their own, for measuring what each costs. The tick does not use them.

pub use crate::stage::Stage;

use crate::dynamics::leg_forces;
use crate::hysteresis::TABLES;
use crate::limits::DAC;
use crate::notch::{modal_error, notch_error};
use crate::setpoint::SETPOINTS;
use crate::step::{actuate, known_load, learn, reaction};
use crate::{Config, LEGS, Real, State, TickInput};
use specgen_runtime::Real as _;
use specgen_runtime::linear::difference;

/// Number of stages.
pub const STAGE_COUNT: usize = 9;

/// All stages, in the order of the tick.
pub const STAGES: [Stage; STAGE_COUNT] = [
    Stage { name: "sense", calls: 1, run: sense },
    Stage { name: "notch", calls: 1, run: notch },
    Stage { name: "learn", calls: 1, run: learning },
    Stage { name: "setpoint", calls: 1, run: setpoint },
    Stage { name: "dynamics", calls: 1, run: dynamics },
    Stage { name: "load", calls: 1, run: load },
    Stage { name: "inverse", calls: LEGS, run: inverse },
    Stage { name: "actuate", calls: LEGS, run: leg },
    Stage { name: "limits", calls: LEGS, run: limits },
];

/// Brings a copy of the state to where the stages find it, with each leg's request in place of its excess; not measured.
pub fn prepare(config: &Config, state: &mut State, input: &TickInput) {
    crate::step::sense(config, state, &input.gauge);
    state.generator.tick(&SETPOINTS, &input.command);
    let (demand, _) = known_load(config, state);
    let reaction = reaction(config, state);
    for (index, leg) in state.legs.iter_mut().enumerate() {
        leg.excess = demand[index] + reaction[index];
    }
}

/// Gauges to pose.
extern "C" fn sense(config: &Config, state: &mut State, input: &TickInput, _leg: usize) {
    crate::step::sense(config, state, &input.gauge);
}

/// The modal notch on the pose error.
extern "C" fn notch(_config: &Config, state: &mut State, _input: &TickInput, _leg: usize) {
    let error = modal_error(&difference(&state.generator.target().pose, &state.pose));
    state.error = notch_error(&mut state.error_notch, &error);
}

/// All that the readings teach: both notches, integral and adaptation.
extern "C" fn learning(config: &Config, state: &mut State, _input: &TickInput, _leg: usize) {
    learn(config, state);
}

/// The generator of set-points.
extern "C" fn setpoint(_config: &Config, state: &mut State, input: &TickInput, _leg: usize) {
    state.generator.tick(&SETPOINTS, &input.command);
}

/// h, ḣ, ḧ to six leg forces.
extern "C" fn dynamics(_config: &Config, state: &mut State, _input: &TickInput, _leg: usize) {
    state.error = leg_forces(state.generator.target());
}

/// Motion to leg displacements and to what the legs give way, as the tick takes it.
extern "C" fn load(config: &Config, state: &mut State, _input: &TickInput, _leg: usize) {
    (state.error, state.wrench) = known_load(config, state);
}

/// Γ⁻¹ of one leg: displacement to drive.
extern "C" fn inverse(_config: &Config, state: &mut State, _input: &TickInput, leg: usize) {
    if let (Some(leg), Some(table)) = (state.legs.get_mut(leg), TABLES.get(leg)) {
        leg.excess = leg.memory.solve(table, leg.excess);
    }
}

/// One leg from request to code: Γ⁻¹, converter and limits, and the reversal memory brought up to date.
extern "C" fn leg(config: &Config, state: &mut State, _input: &TickInput, leg: usize) {
    if let (Some(leg), Some(table)) = (state.legs.get_mut(leg), TABLES.get(leg)) {
        let request = leg.excess;
        actuate(config, leg, table, request);
    }
}

/// One leg from drive to code within voltage and slew limits.
extern "C" fn limits(config: &Config, state: &mut State, _input: &TickInput, leg: usize) {
    if let Some(leg) = state.legs.get_mut(leg) {
        let (code, held_back) = DAC.code(leg.excess, leg.code, config.code_limits());
        leg.code = code;
        leg.requested = if held_back { Real::ZERO } else { DAC.voltage(code) };
    }
}
