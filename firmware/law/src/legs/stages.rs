//! Parts of the tick as functions of their own, for measuring what each costs. The tick does not use them.

use specgen_runtime::SetpointKind;

use super::config::Config;
use super::constants::SixLegs;
use super::state::State;
use super::step::{actuate, take_setpoint};
use super::tick::TickInput;
use crate::kinematics::leg_displacements;
use crate::memory::LegMemory as _;
use crate::spec::{Compiled, LEGS};
use crate::stage::Stage;

/// Number of stages.
pub const STAGE_COUNT: usize = 3;

/// All stages, in the order of the tick.
#[must_use]
pub const fn stages<P: SixLegs + Compiled>() -> [Stage<P>; STAGE_COUNT] {
    [
        Stage { name: "kinematics", calls: 1, run: kinematics::<P> },
        Stage { name: "inverse", calls: LEGS, run: inverse::<P> },
        Stage { name: "actuate", calls: LEGS, run: leg::<P> },
    ]
}

/// Brings a copy of the state to where the stages find it; not measured.
pub fn prepare<P: SixLegs>(p: P, config: &Config<P>, state: &mut State<P>, input: &TickInput<P>) {
    take_setpoint(p, config, state, input);
}

/// Pose to six leg displacements.
extern "C" fn kinematics<P: SixLegs + Compiled>(
    config: &Config<P>,
    state: &mut State<P>,
    input: &TickInput<P>,
    _leg: usize,
) {
    if config.setpoint() == SetpointKind::Pose {
        state.demand = leg_displacements(P::CONSTANTS, &input.setpoint);
    }
}

/// Γ⁻¹ of one leg: displacement to drive.
extern "C" fn inverse<P: SixLegs + Compiled>(
    _config: &Config<P>,
    state: &mut State<P>,
    _input: &TickInput<P>,
    leg: usize,
) {
    if let (Some(leg), Some(table), Some(demand)) =
        (state.legs.get_mut(leg), P::CONSTANTS.tables().get(leg), state.demand.get_mut(leg))
    {
        *demand = leg.memory.solve(table, *demand - leg.estimate.correction());
    }
}

/// One leg from demand to code: Γ⁻¹, converter and limits, and the reversal memory brought up to date.
extern "C" fn leg<P: SixLegs + Compiled>(config: &Config<P>, state: &mut State<P>, _input: &TickInput<P>, leg: usize) {
    if let (Some(leg), Some(table), Some(demand)) =
        (state.legs.get_mut(leg), P::CONSTANTS.tables().get(leg), state.demand.get(leg))
    {
        actuate(P::CONSTANTS, config, leg, table, *demand);
    }
}
