//! Parts of the tick as functions of their own, for measuring what each costs. The tick does not use them.

pub use crate::stage::Stage;

use crate::hysteresis::TABLES;
use crate::kinematics::leg_displacements;
use crate::step::{actuate, take_setpoint};
use crate::{Config, LEGS, SetpointKind, State, TickInput};

/// Number of stages.
pub const STAGE_COUNT: usize = 3;

/// All stages, in the order of the tick.
pub const STAGES: [Stage; STAGE_COUNT] = [
    Stage { name: "kinematics", calls: 1, run: kinematics },
    Stage { name: "inverse", calls: LEGS, run: inverse },
    Stage { name: "actuate", calls: LEGS, run: leg },
];

/// Brings a copy of the state to where the stages find it; not measured.
pub fn prepare(config: &Config, state: &mut State, input: &TickInput) {
    take_setpoint(config, state, input);
}

/// Pose to six leg displacements.
extern "C" fn kinematics(config: &Config, state: &mut State, input: &TickInput, _leg: usize) {
    if config.setpoint() == SetpointKind::Pose {
        state.demand = leg_displacements(&input.setpoint);
    }
}

/// Γ⁻¹ of one leg: displacement to drive.
extern "C" fn inverse(_config: &Config, state: &mut State, _input: &TickInput, leg: usize) {
    if let (Some(leg), Some(table), Some(demand)) =
        (state.legs.get_mut(leg), TABLES.get(leg), state.demand.get_mut(leg))
    {
        *demand = leg.memory.solve(table, *demand - leg.estimate.correction());
    }
}

/// One leg from demand to code: Γ⁻¹, converter and limits, and the reversal memory brought up to date.
extern "C" fn leg(config: &Config, state: &mut State, _input: &TickInput, leg: usize) {
    if let (Some(leg), Some(table), Some(demand)) = (state.legs.get_mut(leg), TABLES.get(leg), state.demand.get(leg)) {
        actuate(config, leg, table, *demand);
    }
}
