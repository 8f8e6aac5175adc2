// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! One control tick.
//!
//! At time t_n the interval that the voltages u_n were held over has just ended and the gauges are read; the set-point is
//! that of the END of the interval that begins now, t_{n+1}, and the voltages that come out are held over it.
//!
//! ```text
//! sense      gauges → h                                                      pose from rest
//! learn      e = N(h_d(t_n) − h) ;  s ← s + T k_I e                          (7), held where it would wind up
//!            ν = N(Y − (q̂ − p) − δ̂ − φ̂) ;  δ̂, φ̂ ← ν                        (AII.3), (AII.5), (AII.6), in modal coordinates
//! setpoint   h_d, ḣ_d, ḧ_d at t_{n+1}
//! load       p = (J⁻ᵀ(M ḧ_d + C ḣ_d + G + K_e (h_d − h_e)) − f_rest)/k_a      known deflection of the legs, (7)
//!            + J⁻ᵀ k_v ė/k_a + τ (Δl(h_d(t_{n+1})) − Δl(h_d(t_n)))/T                  damping, lead
//! legs       q = Δl(h_d) + p + J⁻ᵀ(k_p e + s)/k_a − δ̂ − φ̂ ;  u = Γ⁻¹(q)       limited: q̂ is what was really requested
//! ```
//! N is the modal notch. A correction c that was learned or prepared for the motion (`specgen_runtime::correction`) adds J c to q; like damping the innovation does not see it. Active damping D(z) e, where a spec asks for it, is part of p: `specgen_runtime::damping`. p is a load that the legs really carry, so it belongs to the model of the innovation; the feedback
//! is none and does not.
//!
//! Y = Δl(h) is taken to first order about the set-point, Δl(h_d) − J e. With q = Δl(h_d) + p + f − δ̂ − φ̂ + b (feedback f,
//! offset b of a change of mode) and w = q − q̂ withheld by limits, the innovation is then w − b − f − J e: no large numbers
//! are subtracted, and f is small in modal coordinates, too. What is left out is the error times the change of J over the
//! workspace, a thousandth of it, and the rounding of the converter on a leg that is free.
//!
//! δ̂ and φ̂ are kept in modal coordinates, where N works: with the same weights on every leg the law commutes with the map
//! between them, and one map takes feedback and estimates to the legs, J⁻ᵀF/k_a − δ̂ − φ̂ = J V (V⁻¹K⁻¹F − δ̂ − φ̂).

use crate::hysteresis::{TABLES, Table};
use crate::limits::DAC;
use crate::notch::{modal_error, notch_error, notch_innovation};
use crate::setpoint::SETPOINTS;
use crate::task_space::{
    AFFINE_LOAD, CELLS_PER_METRE, COMPLIANCE, CORRECTION, DAMPING, FORCE_TO_MODES, HANDS_OVER, LEAD, LED,
    LEGS_TO_MODES, LEGS_TO_WRENCH, METRES_PER_CELL, MODES_TO_LEGS, OWN_LEADS, PERIOD, REST_FORCE, TRANSFER_KEEP,
    TRANSFER_NEGLIGIBLE, WRENCH_LIMIT, WRENCH_TO_LEGS,
};
use crate::tick::{CORRECTION_LIMITED, WRENCH_FAULT};
use crate::{Config, LEGS, LegState, Real, State, TickInput, TickOutput, dynamics, kinematics, sensing};
use specgen_runtime::feedback::{force_of, winds_up};
use specgen_runtime::linear::{difference, each, transform};
use specgen_runtime::setpoint::CommandKind;
use specgen_runtime::supervisor::Fallback;
use specgen_runtime::{ControlMode, Damping, Estimate, Integral, Interaction, Law, NotchState};

/// One control tick. See the module for the timing.
pub fn step(config: &Config, state: &mut State, input: &TickInput) -> TickOutput {
    let status = advance(config, state, Fallback::None, input.command.kind, input);
    outputs(state, status)
}

/// The work of a tick of the law, or of what it has fallen back to, with `kind` in place of that of the command; returns its status.
pub(crate) fn advance(
    config: &Config,
    state: &mut State,
    fallback: Fallback,
    kind: CommandKind,
    input: &TickInput,
) -> u32 {
    if state.fallback != fallback {
        fall_back(state, fallback);
    }
    let entered = enter_mode(config, state);
    let gauge_faults = sense(config, state, &input.gauge);
    if gauge_faults == 0 {
        learn(config, state);
    } else {
        state.damping.act(&DAMPING, &[0.0; 6]);
    }
    let wrench_good = take_wrench(config, state, &input.wrench);
    let damping = damping(config, state);
    let played = state.generator.plays();
    let moved = HANDS_OVER && state.generator.can_stop();
    let setpoint_status = state.generator.tick_as(&SETPOINTS, kind, &input.command);
    if moved && !state.generator.can_stop() {
        rest(config, state);
    }
    let (demand, load) = known_load(config, state);
    let correction_held = state.correction.follow(&CORRECTION, &input.correction);
    let reaction = reaction(config, state);
    if LEAD == 0.0 && LED == 0 {
        state.load = load;
    } else {
        let lead = lead(played.or(state.generator.plays()));
        state.load = each(|leg| load[leg] + (demand[leg] - state.demand[leg]) * lead);
    }
    state.demand = demand;
    if let Some(damping) = &damping {
        state.load = each(|leg| state.load[leg] + damping[leg]);
    }
    let mut request = each(|leg| demand[leg] + state.load[leg] + reaction[leg]);
    if entered {
        hand_over(config, state, &request);
        request = each(|leg| state.legs[leg].requested);
    } else {
        state.transfer.fade(TRANSFER_KEEP, TRANSFER_NEGLIGIBLE);
        if state.transfer.is_active() {
            let offset = state.transfer.offset();
            request = each(|leg| request[leg] + offset[leg]);
        }
    }
    let mut limited = 0;
    for (index, (leg, table)) in state.legs.iter_mut().zip(&TABLES).enumerate() {
        let held_back = actuate(config, leg, table, request[index]);
        limited |= (held_back as u32) << index;
    }
    state.limited = limited != 0;
    let mut static_inverse = 0;
    for (index, leg) in state.legs.iter().enumerate() {
        static_inverse |= ((config.mode().inverts() && leg.memory.fell_back()) as u32) << (24 + index);
    }
    let inputs = if wrench_good { 0 } else { WRENCH_FAULT } | if correction_held { CORRECTION_LIMITED } else { 0 };
    static_inverse | limited | gauge_faults << 8 | setpoint_status | inputs
}

/// Lead of a trajectory that is played, or of any other motion.
#[inline]
fn lead(played: Option<u32>) -> Real {
    match played {
        Some(selector) if LED != 0 => OWN_LEADS.get(selector as usize).copied().unwrap_or(LEAD),
        _ => LEAD,
    }
}

/// What goes out, of the state that the tick left.
#[inline]
pub(crate) fn outputs(state: &State, status: u32) -> TickOutput {
    let legs = &state.legs;
    TickOutput { voltage: each(|leg| DAC.voltage(legs[leg].code)), dac_code: each(|leg| legs[leg].code), status }
}

/// Whether this tick is the first of its mode, or of its source of the interaction force. If so, what the mode does not
/// use is put at rest; the first request then defines what keeps the voltages where they are.
#[inline]
fn enter_mode(config: &Config, state: &mut State) -> bool {
    let (mode, interaction) = (config.mode(), config.interaction());
    let same_force = state.interaction == interaction
        && (interaction != Interaction::Modelled || state.environment == *config.environment());
    if state.mode == Some(mode) && same_force {
        return false;
    }
    let adapted = match state.mode {
        Some(before) => before.law() != Law::Invhys,
        None => false,
    };
    if mode.law() != Law::Invhys && !adapted {
        state.integral = Integral::new();
        state.deflection = [0.0; 6];
    }
    state.mode = Some(mode);
    state.interaction = interaction;
    state.environment = *config.environment();
    for estimate in &mut state.estimates {
        match mode.law() {
            Law::Invhys => *estimate = Estimate::new(),
            Law::Ewma => estimate.drift = 0.0,
            Law::Pcc => {}
        }
    }
    for leg in &mut state.legs {
        leg.requested = requested(mode, leg);
        leg.excess = 0.0;
    }
    state.limited = false;
    if mode.law() == Law::Invhys {
        state.innovation_notch = NotchState::new();
    }
    if !mode.damps_modes() {
        state.damping = Damping::new();
    }
    if !mode.feeds_back() {
        state.integral = Integral::new();
        state.error_notch = NotchState::new();
        state.error = [0.0; 6];
        state.deflection = [0.0; 6];
    }
    true
}

/// Gives what the first `request` of a mode (m of each leg) lacks to where the legs stand to what the mode would itself
/// come to hold it with: the estimates, else the integral if every axis has one. Else it becomes an offset that fades.
#[cold]
fn hand_over(config: &Config, state: &mut State, request: &[Real; LEGS]) {
    let held = each(|leg| state.legs[leg].requested - request[leg]);
    let mode = config.mode();
    let mut offset = [0.0; LEGS];
    if mode.law() != Law::Invhys {
        for (estimate, held) in state.estimates.iter_mut().zip(transform(&LEGS_TO_MODES, &held)) {
            estimate.level -= held;
        }
    } else if mode.feeds_back() && config.active_gains().integral.iter().all(|gain| *gain > 0.0) {
        state.integral.grow(&transform(&LEGS_TO_WRENCH, &held));
    } else {
        offset = held;
    }
    state.transfer.begin(offset);
}

/// The law falls back, or has all its parts again. What damping and gains asked for against the oscillation ends at once: to keep
/// what it happened to be in this tick would put the platform off by as much. Integral and estimates stay.
#[cold]
#[inline(never)]
fn fall_back(state: &mut State, fallback: Fallback) {
    state.fallback = fallback;
    state.damping = Damping::new();
    if fallback == Fallback::FeedForward {
        for estimate in &mut state.estimates {
            // δ̂ would go on with φ̂.
            *estimate = Estimate { level: estimate.correction(), drift: 0.0 };
        }
    }
}

/// An error, or an innovation, as far as the fallback lets it count.
#[cold]
#[inline(never)]
fn weaken(fallback: Fallback, values: &mut [Real; 6]) {
    let share: Real = fallback.share();
    for value in values {
        *value *= share;
    }
}

/// The set-point has come to rest: the estimates take over what the integral gathered on the way. Nothing else of the request changes. Both
/// work on one error; the integral would give back at the rate of k_I/(1 + k_p) what the estimates unlearn at theirs.
#[cold]
fn rest(config: &Config, state: &mut State) {
    let mode = config.mode();
    if mode.feeds_back() && mode.law() != Law::Invhys {
        let held = transform(&FORCE_TO_MODES, &state.integral.force);
        for (estimate, held) in state.estimates.iter_mut().zip(held) {
            estimate.level -= held;
        }
        state.integral = Integral::new();
    }
}

/// h and ḣ from the gauges; returns the gauges that are not believed, bit by bit. With any such the last pose is held.
#[inline]
pub(crate) fn sense(config: &Config, state: &mut State, gauge: &[Real; 6]) -> u32 {
    let faults = sensing::faults(gauge);
    if faults == 0 {
        state.pose = sensing::pose(gauge);
    }
    if !config.damps() {
        state.rate.rest();
    } else if faults == 0 {
        state.rate.update(&sensing::RATE, &state.pose);
    } else {
        state.rate.coast(&sensing::RATE);
    }
    faults
}

/// What the readings teach: the integral of (7), the run-to-run estimates, and what is asked for against the modes.
#[inline]
pub(crate) fn learn(config: &Config, state: &mut State) {
    let mode = config.mode();
    let error = modal_error(&difference(&state.generator.target().pose, &state.pose));
    let fallback = state.fallback;
    if mode.damps_modes() && fallback == Fallback::None {
        state.damping.act(&DAMPING, &error);
    }
    if mode.feeds_back() {
        state.error = notch_error(&mut state.error_notch, &error);
        if fallback != Fallback::None {
            weaken(fallback, &mut state.error);
        }
        let growth = Integral::growth(&config.active_gains().integral, PERIOD, &state.error);
        if !(state.limited && would_wind_up(&state.legs, &growth)) {
            state.integral.grow(&growth);
        }
    }
    if mode.law() != Law::Invhys {
        let disturbed = state.limited || state.transfer.is_active();
        let mut innovation = each(|mode| -error[mode] - state.deflection[mode]);
        if disturbed {
            let offset = state.transfer.offset();
            let withheld = each(|leg| state.legs[leg].excess - offset[leg]);
            let withheld = transform(&LEGS_TO_MODES, &withheld);
            innovation = each(|mode| innovation[mode] + withheld[mode]);
        }
        let mut innovation = notch_innovation(&mut state.innovation_notch, &innovation);
        if fallback != Fallback::None {
            weaken(fallback, &mut innovation);
        }
        let (level, drift) = (config.level_weight(), config.drift_weight());
        Estimate::correct(&mut state.estimates, mode.law(), level, drift, &innovation);
    }
}

/// Whether the integral's growth would push a leg further beyond the limit that holds it back.
#[inline]
fn would_wind_up(legs: &[LegState; LEGS], growth: &[Real; 6]) -> bool {
    let excess = each(|leg| legs[leg].excess);
    winds_up(&excess, &transform(&WRENCH_TO_LEGS, growth))
}

/// Takes the measured wrench if it is to be believed; one that nobody asks for is not looked at.
#[inline]
fn take_wrench(config: &Config, state: &mut State, wrench: &[Real; 6]) -> bool {
    if config.interaction() != Interaction::Measured {
        return true;
    }
    let good = wrench.iter().zip(&WRENCH_LIMIT).all(|(value, limit)| (-*limit..=*limit).contains(value));
    if good {
        state.wrench = *wrench;
    }
    good
}

/// J⁻ᵀ k_v ė/k_a with ė = ḣ_d(t_n) − ḣ: m of each leg; none without k_v.
#[inline]
fn damping(config: &Config, state: &State) -> Option<[Real; LEGS]> {
    if !config.damps() {
        return None;
    }
    let mut error = difference(&state.generator.target().rate, state.rate.value());
    if state.fallback != Fallback::None {
        weaken(state.fallback, &mut error);
    }
    Some(transform(&WRENCH_TO_LEGS, &force_of(&config.active_gains().derivative, &error)))
}

/// Leg displacements at the set-point, and by how much the legs give way to motion, gravity and the work piece there, (7); m.
#[inline]
pub(crate) fn known_load(config: &Config, state: &State) -> ([Real; LEGS], [Real; LEGS]) {
    let target = state.generator.target();
    let wrench = match config.interaction() {
        Interaction::Neglected => {
            if let Some(affine) = &AFFINE_LOAD {
                return (kinematics::leg_displacements(&target.pose), affine.deflection(target));
            }
            None
        }
        Interaction::Measured => Some(state.wrench),
        Interaction::Modelled => {
            let environment = config.environment();
            Some(force_of(&environment.stiffness, &difference(&environment.rest, &target.pose)))
        }
    };
    let load = dynamics::load(target, wrench.as_ref());
    (load.displacement, each(|leg| (load.force[leg] - REST_FORCE[leg]) * COMPLIANCE))
}

/// J⁻ᵀ(k_p e + s)/k_a − δ̂ − φ̂, what is asked for against the modes, and J c: m of each leg.
#[inline]
pub(crate) fn reaction(config: &Config, state: &mut State) -> [Real; LEGS] {
    if config.mode().feeds_back() {
        let proportional = force_of(&config.active_gains().proportional, &state.error);
        let integral = &state.integral.force;
        let force = each(|axis| proportional[axis] + integral[axis]);
        state.deflection = transform(&FORCE_TO_MODES, &force);
    }
    let wanted = each(|mode| state.deflection[mode] - state.estimates[mode].correction());
    let mut wanted = state.damping.beside(wanted);
    if let Some(correction) = state.correction.pose() {
        let correction = modal_error(&correction);
        wanted = each(|mode| wanted[mode] + correction[mode]);
    }
    transform(&MODES_TO_LEGS, &wanted)
}

/// The request as a permitted code; the memory then holds the drive of that code. Returns whether a limit of table,
/// voltage or slew rate held the leg back.
#[inline(never)]
pub fn actuate(config: &Config, leg: &mut LegState, table: &Table, request: Real) -> bool {
    if config.mode().inverts() && track(config, leg, table, request) {
        return false;
    }
    actuate_limited(config, leg, table, request)
}

/// The short way of a leg that tracks; where it is none, nothing has changed. Returns whether it was one.
#[inline(always)]
fn track(config: &Config, leg: &mut LegState, table: &Table, request: Real) -> bool {
    let previous = leg.code;
    let mut code = previous;
    let tracked = leg.memory.track(table, &mut leg.last, request, |drive| {
        code = DAC.free_code(drive, previous, config.code_limits())?;
        Some(DAC.drive(code))
    });
    if tracked {
        leg.code = code;
        leg.requested = leg.memory.displacement();
        leg.excess = 0.0;
    }
    tracked
}

/// [`actuate`] whatever the request.
#[inline(never)]
fn actuate_limited(config: &Config, leg: &mut LegState, table: &Table, request: Real) -> bool {
    let LegState { memory, code, .. } = leg;
    let mut limited = false;
    let mut permitted = |drive: Real| {
        let (permitted, held_back) = DAC.code(drive, *code, config.code_limits());
        *code = permitted;
        limited |= held_back;
        DAC.drive(permitted)
    };
    if config.mode().inverts() {
        let out_of_reach = memory.follow_within(table, request, &mut permitted);
        limited |= out_of_reach;
        leg.requested = leg.memory.displacement();
    } else {
        let drive = permitted(request * CELLS_PER_METRE);
        memory.apply(table, drive);
        leg.requested = drive * METRES_PER_CELL;
    }
    leg.excess = if limited { request - leg.requested } else { 0.0 };
    limited
}

/// What the code that is held means in the leg model of a mode, m.
#[inline]
fn requested(mode: ControlMode, leg: &LegState) -> Real {
    if mode.inverts() { leg.memory.displacement() } else { DAC.drive(leg.code) * METRES_PER_CELL }
}
