//! Parts of the tick as separate functions, to measure their cost. The tick does not use them.

use specgen_runtime::SetpointKind;

use super::constants::SixLegs;
use super::state::State;
use super::step::{self, take_setpoint};
use super::tick::TickInput;
use crate::kinematics::leg_displacements;
use crate::memory::LegMemory as _;
use crate::spec::{Config, ConstSpec, LEGS};
use crate::stage::{Stage, stages};

/// Prepares a copy of the state for the stages; not measured.
pub fn prepare<P: SixLegs>(p: P, config: &Config<P>, state: &mut State<P>, input: &TickInput<P>) {
    take_setpoint(p, config, state, input);
}

stages! { SixLegs, |p, config, state, input, leg|
    /// Pose to six leg displacements.
    kinematics, 1 => {
        if config.setpoint == SetpointKind::Pose {
            state.demand = leg_displacements(p, &input.setpoint);
        }
    }
    /// Γ⁻¹ of one leg: displacement to drive.
    inverse, LEGS => {
        if let (Some(leg), Some(table), Some(demand)) =
            (state.legs.get_mut(leg), p.tables().get(leg), state.demand.get_mut(leg))
        {
            *demand = leg.memory.solve(table, *demand - leg.estimate.correction());
        }
    }
    /// One leg from demand to code: Γ⁻¹, converter and limits, and the update of the reversal memory.
    actuate, LEGS => {
        if let (Some(leg), Some(table), Some(demand)) =
            (state.legs.get_mut(leg), p.tables().get(leg), state.demand.get(leg))
        {
            step::actuate(p, config, leg, table, *demand);
        }
    }
}
