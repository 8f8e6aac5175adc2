//! Output lines at positions, levels, in motion, at set-points and ticks: their inputs in a supervised tick.

use specgen_runtime::setpoint::CommandKind;
use specgen_runtime::supervisor::Phase;
use specgen_runtime::trigger::{Observation, OutputLines as _};

use super::constants::Platform;
use super::state::State;
use super::tick::TickInput;
use crate::spec::Config;
use crate::status::{GENERATOR_BUSY, SETPOINT_FAULT, SETPOINT_STALE};

/// After the law: bits of the status for the lines over the next interval, from the pose at its beginning. They are low
/// unless the law runs.
#[inline]
pub(crate) fn fire<P: Platform>(
    config: &Config<P>,
    state: &mut State<P>,
    phase: Phase,
    input: &TickInput<P>,
    status: u32,
) -> u32 {
    if !state.triggers.any() {
        return 0;
    }
    let State { triggers, pose, generator, .. } = state;
    if phase != Phase::Running {
        return triggers.rest();
    }
    let command = &input.command;
    let follows = status & (SETPOINT_FAULT | SETPOINT_STALE | GENERATOR_BUSY) == 0;
    let seen = Observation {
        pose,
        moves: status & GENERATOR_BUSY != 0 || generator.can_stop(),
        streams: command.kind == CommandKind::Stream && follows,
        sequence: command.sequence,
    };
    triggers.tick(&config.triggers, &seen)
}
