//! One control tick.
//!
//! At time t_n the interval with voltage u_n has just ended, and Y_n is read. The set-point is for the END of the
//! interval that begins now, T_{n+1}; the new voltages are held over it.

use specgen_runtime::linear::is_within;
use specgen_runtime::real::saturate;
use specgen_runtime::sensing::faults;
use specgen_runtime::supervisor::Fallback;
use specgen_runtime::{Law, SetpointKind};

use super::constants::SixLegs;
use super::lead::{DeadTimeLead as _, LastChange as _};
use super::state::{LegState, State};
use super::tick::TickInput;
use crate::kinematics::leg_displacements;
use crate::memory::LegMemory as _;
use crate::spec::{Config, LEGS};
use crate::status::SETPOINT_FAULT;

/// A tick of the law, or of its fallback; returns the status.
pub fn advance<P: SixLegs>(
    p: P,
    config: &Config<P>,
    state: &mut State<P>,
    fallback: Fallback,
    input: &TickInput<P>,
) -> u32 {
    let demand_before = state.demand;
    let accepted = take_setpoint(p, config, state, input);
    let run_ends = count_run(config, state);
    let faults = faults(&input.displacement, p.raw_limits());
    let mut status = faults << 8 | if accepted { 0 } else { SETPOINT_FAULT };
    for (index, (leg, table)) in state.legs.iter_mut().zip(p.tables()).enumerate() {
        if config.law == Law::Invhys || (run_ends && (faults >> index) & 1 == 0) {
            adapt(config, leg, fallback, input.displacement[index]);
        }
        let change = state.demand[index] - demand_before[index];
        let of_drive = leg.change.differences(demand_before[index], change, p.gain_growth());
        leg.lead.ask(|| {
            let lead = match of_drive {
                Some([first, second]) => change * p.lead() + (first * p.lag() + second * p.bend()),
                None => change * p.lead(),
            };
            saturate(lead, -p.lead_limit(), p.lead_limit())
        });
        let limited = actuate(p, config, leg, table, state.demand[index]);
        status |= (limited as u32) << index | (leg.memory.fell_back() as u32) << (24 + index);
    }
    status
}

/// T = Δl(h_d), or T itself. A set-point that is not accepted leaves the last demand unchanged.
#[inline]
pub fn take_setpoint<P: SixLegs>(p: P, config: &Config<P>, state: &mut State<P>, input: &TickInput<P>) -> bool {
    let accepted = is_accepted(p, config, &input.setpoint);
    if accepted {
        state.demand = match config.setpoint {
            SetpointKind::Pose => leg_displacements(p, &input.setpoint),
            SetpointKind::Leg => input.setpoint,
        };
    }
    accepted
}

/// Whether every number of a set-point is finite, and within the declared workspace or the legs' range.
#[inline]
pub fn is_accepted<P: SixLegs>(p: P, config: &Config<P>, setpoint: &[P::Real; LEGS]) -> bool {
    match config.setpoint {
        SetpointKind::Pose => is_within(setpoint, p.pose_bound()),
        SetpointKind::Leg => setpoint.iter().all(|value| (p.leg_setpoint()[0]..=p.leg_setpoint()[1]).contains(value)),
    }
}

/// Whether a run of `run_interval` ticks ends with this reading.
#[inline]
fn count_run<P: SixLegs>(config: &Config<P>, state: &mut State<P>) -> bool {
    let ticks = state.ticks_in_run.saturating_add(1);
    let ends = ticks >= config.run_interval;
    state.ticks_in_run = if ends { 0 } else { ticks };
    ends
}

/// m = Y − ρ̂X, then (AII.3) or (AII.5), (AII.6), with the weights of the fallback stage.
#[inline]
fn adapt<P: SixLegs>(config: &Config<P>, leg: &mut LegState<P>, fallback: Fallback, gauge: P::Real) {
    let model_error = gauge - leg.shown();
    let share: P::Real = fallback.share();
    let (level, drift) = (config.level_weight * share, config.drift_weight * share);
    leg.estimate.update(config.law, level, drift, model_error);
}

/// u = Γ⁻¹(T − δ̂ − φ̂) as a permitted code; the memory then follows that code. Returns whether a limit of table,
/// voltage or slew rate held the leg back.
#[inline]
pub fn actuate<P: SixLegs>(p: P, config: &Config<P>, leg: &mut LegState<P>, table: &P::Table, demand: P::Real) -> bool {
    let led = match leg.lead.asked() {
        Some(lead) => demand + lead,
        None => demand,
    };
    let request = led - leg.estimate.correction();
    let out_of_reach = !leg.memory.reaches(table, request);
    let drive = leg.memory.solve(table, request);
    let (code, held_back) = p.dac().code(drive, leg.code, config.code_limits);
    leg.code = code;
    leg.memory.apply(table, p.dac().drive(code));
    out_of_reach || held_back
}
