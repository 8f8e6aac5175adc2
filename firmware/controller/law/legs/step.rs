//! One control tick.
//!
//! At time t_n the interval that voltage u_n was held over has just ended and Y_n is read; the set-point is that of the
//! END of the interval that begins now, T_{n+1}, and the voltages that come out are held over it.

use crate::hysteresis::{LEAD, LEAD_LIMIT, LED, TABLES, Table};
use crate::limits::DAC;
use crate::sensing::{gauge_is_accepted, leg_setpoint_is_accepted};
use crate::{Config, LEGS, LegState, Real, SetpointKind, State, kinematics};
use specgen_runtime::Law;
use specgen_runtime::linear::each;
use specgen_runtime::real::saturate;

/// Bits 0 to 5 of the status: leg held back by table, voltage or slew limit.
pub const LEG_LIMITED: u32 = 0x3f;

/// Bits 8 to 13: gauge not finite or out of range; the leg's estimates were held.
pub const GAUGE_FAULT: u32 = 0x3f00;

/// Bit 16: set-point not finite or out of bounds; the last accepted one was held.
pub const SETPOINT_FAULT: u32 = 0x1_0000;

/// Bits 24 to 29: the rate-dependent inverse of the leg was not safe to use; the static one stood in for it. Never set by models
/// with one inverse.
pub const STATIC_INVERSE: u32 = 0x3f00_0000;

/// What a tick reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickInput {
    /// Set-point for the end of the coming interval: pose from rest (m, rad) or leg displacements (m), as
    /// [`Config::setpoint`] says.
    pub setpoint: [Real; 6],
    /// Gauge reading Y of each leg, m, zero at rest.
    pub displacement: [Real; LEGS],
}

/// What a tick yields. Every number is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickOutput {
    /// Voltage of each leg for the coming interval, V: exactly that of [`TickOutput::dac_code`].
    pub voltage: [Real; LEGS],
    /// q̂ = ρ̂X: displacement really requested of each leg, after all limits, m.
    pub requested: [Real; LEGS],
    /// T: displacement demanded of each leg, m.
    pub demand: [Real; LEGS],
    /// δ̂ of each leg, m.
    pub level: [Real; LEGS],
    /// φ̂ of each leg, m.
    pub drift: [Real; LEGS],
    /// Converter code of each leg.
    pub dac_code: [i32; LEGS],
    /// [`LEG_LIMITED`], [`GAUGE_FAULT`], [`SETPOINT_FAULT`].
    pub status: u32,
}

/// One control tick. See the module for the timing.
pub fn step(config: &Config, state: &mut State, input: &TickInput) -> TickOutput {
    let status = advance(config, state, input);
    outputs(state, status)
}

/// The work of a tick; returns its status.
pub(crate) fn advance(config: &Config, state: &mut State, input: &TickInput) -> u32 {
    let demand_before = state.demand;
    let accepted = take_setpoint(config, state, input);
    let run_ends = count_run(config, state);
    let mut status = if accepted { 0 } else { SETPOINT_FAULT };
    for (index, (leg, table)) in state.legs.iter_mut().zip(&TABLES).enumerate() {
        let gauge = input.displacement[index];
        let gauge_good = gauge_is_accepted(gauge);
        if config.law() == Law::Invhys || (run_ends && gauge_good) {
            adapt(config, leg, gauge);
        }
        if LED {
            leg.lead = saturate((state.demand[index] - demand_before[index]) * LEAD, -LEAD_LIMIT, LEAD_LIMIT);
        }
        let limited = actuate(config, leg, table, state.demand[index]);
        status |= (limited as u32) << index
            | (!gauge_good as u32) << (8 + index)
            | (leg.memory.fell_back() as u32) << (24 + index);
    }
    status
}

/// What goes out, and what the state is that the tick left.
#[inline]
pub(crate) fn outputs(state: &State, status: u32) -> TickOutput {
    let legs = &state.legs;
    TickOutput {
        voltage: each(|leg| DAC.voltage(legs[leg].code)),
        requested: each(|leg| shown(&legs[leg])),
        demand: state.demand,
        level: each(|leg| legs[leg].estimate.level),
        drift: each(|leg| legs[leg].estimate.drift),
        dac_code: each(|leg| legs[leg].code),
        status,
    }
}

/// T = Δl(h_d), or T itself. A set-point that is not accepted leaves the last demand standing.
#[inline]
pub(crate) fn take_setpoint(config: &Config, state: &mut State, input: &TickInput) -> bool {
    let accepted = match config.setpoint() {
        SetpointKind::Pose => kinematics::pose_is_accepted(&input.setpoint),
        SetpointKind::Leg => leg_setpoint_is_accepted(&input.setpoint),
    };
    if accepted {
        state.demand = match config.setpoint() {
            SetpointKind::Pose => kinematics::leg_displacements(&input.setpoint),
            SetpointKind::Leg => input.setpoint,
        };
    }
    accepted
}

/// Whether a run of `run_interval` ticks ends with this reading.
#[inline]
fn count_run(config: &Config, state: &mut State) -> bool {
    let ticks = state.ticks_in_run.saturating_add(1);
    let ends = ticks >= config.run_interval();
    state.ticks_in_run = if ends { 0 } else { ticks };
    ends
}

/// ρ̂X, m: what the leg is to show. The lead is no part of it: the leg is asked for it so that it arrives in time.
#[inline]
fn shown(leg: &LegState) -> Real {
    if LED { leg.memory.displacement() - leg.lead } else { leg.memory.displacement() }
}

/// m = Y − ρ̂X, then (AII.3) or (AII.5), (AII.6).
#[inline]
fn adapt(config: &Config, leg: &mut LegState, gauge: Real) {
    let model_error = gauge - shown(leg);
    leg.estimate.update(config.law(), config.level_weight(), config.drift_weight(), model_error);
}

/// u = Γ⁻¹(T − δ̂ − φ̂) as a permitted code; the memory then holds what that code really requests. Returns whether a
/// limit of table, voltage or slew rate held the leg back.
#[inline]
pub fn actuate(config: &Config, leg: &mut LegState, table: &Table, demand: Real) -> bool {
    let led = if LED { demand + leg.lead } else { demand };
    let request = led - leg.estimate.correction();
    let out_of_reach = !leg.memory.reaches(table, request);
    let drive = leg.memory.solve(table, request);
    let (code, held_back) = DAC.code(drive, leg.code, config.code_limits());
    leg.code = code;
    leg.memory.apply(table, DAC.drive(code));
    out_of_reach || held_back
}
