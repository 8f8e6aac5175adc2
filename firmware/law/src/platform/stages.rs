//! Parts of the tick as separate functions, to measure their cost. The tick does not use them.

use specgen_runtime::Real as _;
use specgen_runtime::linear::difference;

use super::constants::Platform;
use super::notch::{modal_error, notch_error};
use super::state::State;
use super::step::{self, known_load, reaction};
use super::tick::TickInput;
use crate::memory::LegMemory as _;
use crate::spec::{Config, ConstSpec, LEGS};
use crate::stage::{Stage, stages};

/// Prepares a copy of the state for the stages, with each leg's request in place of its excess; not measured.
pub fn prepare<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>, input: &TickInput<P>) {
    step::sense(p, config, state, &input.gauge);
    state.generator.tick(p.setpoints(), &input.command);
    let (demand, _) = known_load(p, config, state);
    let reaction = reaction(p, config, state);
    for (index, leg) in state.legs.iter_mut().enumerate() {
        leg.excess = demand[index] + reaction[index];
    }
}

stages! { Platform, |p, config, state, input, leg|
    /// Gauges to pose.
    sense, 1 => {
        step::sense(p, config, state, &input.gauge);
    }
    /// The modal notch on the pose error.
    notch, 1 => {
        let error = modal_error(p, &difference(&state.generator.target().pose, &state.pose));
        state.error = notch_error(p, &mut state.error_notch, &error);
    }
    /// Everything learned from the readings: both notches, integral and adaptation.
    learn, 1 => {
        step::learn(p, config, state);
    }
    /// The generator of set-points.
    setpoint, 1 => {
        state.generator.tick(p.setpoints(), &input.command);
    }
    /// h, ḣ, ḧ to six leg forces.
    dynamics, 1 => {
        state.error = p.body().leg_forces(state.generator.target());
    }
    /// Motion to leg displacements and deflections, as in the tick.
    load, 1 => {
        (state.error, state.wrench) = known_load(p, config, state);
    }
    /// Γ⁻¹ of one leg: displacement to drive.
    inverse, LEGS => {
        if let (Some(leg), Some(table)) = (state.legs.get_mut(leg), p.tables().get(leg)) {
            leg.excess = leg.memory.solve(table, leg.excess);
        }
    }
    /// One leg from request to code: Γ⁻¹, converter and limits, and the update of the reversal memory.
    actuate, LEGS => {
        if let (Some(leg), Some(table)) = (state.legs.get_mut(leg), p.tables().get(leg)) {
            let request = leg.excess;
            step::actuate(p, config, leg, table, request);
        }
    }
    /// One leg from drive to code within voltage and slew limits.
    limits, LEGS => {
        if let Some(leg) = state.legs.get_mut(leg) {
            let (code, held_back) = p.dac().code(leg.excess, leg.code, config.code_limits);
            leg.code = code;
            leg.requested = if held_back { P::Real::ZERO } else { p.dac().voltage(code) };
        }
    }
}
