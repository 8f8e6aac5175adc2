//! One control tick.
//!
//! At time t_n the interval with voltages u_n has just ended, and the gauges are read. The set-point is for the END of
//! the interval that begins now, t_{n+1}; the new voltages are held over it.
//!
//! ```text
//! sense      gauges → h                                                      pose from rest
//! learn      e = N(h_d(t_n) − h) ;  s ← s + T_s k_I e                        (7), held where it would wind up
//!            ν = N(Y − (q̂ − p) − δ̂ − φ̂) ;  δ̂, φ̂ ← ν                        (AII.3), (AII.5), (AII.6), in modal coordinates
//! setpoint   h_d, ḣ_d, ḧ_d at t_{n+1}
//! load       p = (J⁻ᵀ(M ḧ_d + C ḣ_d + G − F_int) − f_rest)/k_a + E J h_d       known deflection of the legs, (7); cross-talk
//!            + J⁻ᵀ k_v ė/k_a + τ (Δl(h_d(t_{n+1})) − Δl(h_d(t_n)))/T_s                damping, lead
//! legs       q = Δl(h_d) + p + J⁻ᵀ(k_p e + s)/k_a − δ̂ − φ̂ ;  u = Γ⁻¹(q)       limited: q̂ is q within the limits
//! ```
//! N is the modal notch, T_s the period. F_int is the wrench of the work piece on the platform: K_e (h_e − h_d), or
//! measured. Two further terms of q are J c of a correction c that was learned or prepared
//! for the motion (`specgen_runtime::correction`), and J V D(z) V⁻¹ (h_d − h) of active damping
//! (`specgen_runtime::damping`).
//!
//! The innovation ν compares Y with q̂ − p, because the load p deflects the legs. Lead, k_v, active damping and
//! correction are no loads, but ν leaves them out in the same way. The feedback f = J⁻ᵀ(k_p e + s)/k_a stays in ν.
//!
//! Y = Δl(h) is linearised about the set-point, Δl(h_d) − J (h_d − h). With the offset b of a change of mode and the part
//! w = q − q̂ that limits withhold, q = Δl(h_d) + p + f − δ̂ − φ̂ + b gives ν = N(w − b − f − J (h_d − h)). This form does not
//! subtract large numbers. It neglects the error times the change of J over the workspace, about a thousandth of the
//! error, and the rounding of the converter on a leg that no limit holds back.
//!
//! δ̂ and φ̂ are in modal coordinates, as N is. The law has equal weights on all legs, so it is the same in both
//! coordinates, and one map takes feedback and estimates to the legs: J⁻ᵀF/k_a − δ̂ − φ̂ = J V (V⁻¹K⁻¹F − δ̂ − φ̂).

use specgen_runtime::feedback::{force_of, winds_up};
use specgen_runtime::linear::{difference, each, is_within, transform};
use specgen_runtime::sensing::faults;
use specgen_runtime::setpoint::CommandKind;
use specgen_runtime::supervisor::Fallback;
use specgen_runtime::{
    ControlMode, Estimate, Integral, Interaction, Law, ModalDamping as _, NotchState, Real, RequestCorrection as _,
};

use super::constants::Platform;
use super::notch::{modal_error, notch_error, notch_innovation};
use super::sensing;
use super::state::{LegState, State};
use super::tick::TickInput;
use crate::kinematics::leg_displacements;
use crate::memory::LegMemory as _;
use crate::spec::{Config, LEGS};
use crate::status::{CORRECTION_LIMITED, GAUGE_FAULT, STATIC_INVERSE, WRENCH_FAULT};

/// Computes one tick at this fallback stage and returns the status. The set-point command is of this `kind`, whatever
/// the input requests: the supervisor may hold the platform.
pub fn advance<P: Platform>(
    p: P,
    config: &Config<P>,
    state: &mut State<P>,
    fallback: Fallback,
    kind: CommandKind,
    input: &TickInput<P>,
) -> u32 {
    if state.fallback != fallback {
        fall_back(state, fallback);
    }
    let entered = enter_mode(p, config, state);
    let gauge_faults = sense(p, config, state, &input.gauge);
    if gauge_faults == 0 {
        learn(p, config, state);
    } else {
        // Without a pose the damping gets no error, and its request decays.
        state.damping.update(p.damping(), &[P::Real::ZERO; 6]);
    }
    let wrench_valid = take_wrench(p, config, state, &input.wrench);
    let velocity_feedback = velocity_feedback(p, config, state);
    let trajectory_before = state.generator.plays();
    // The generator can stop while a motion is under way, not at rest.
    let was_moving = p.hands_over() && state.generator.can_stop();
    let setpoint_status = state.generator.tick_as(p.setpoints(), kind, &input.command);
    if was_moving && !state.generator.can_stop() {
        integral_to_estimates(p, config, state);
    }
    let (demand, load) = known_load(p, config, state);
    let correction_limited = state.correction.follow(p.correction(), &input.correction);
    let reaction = reaction(p, config, state);
    if p.lead() == P::Real::ZERO && p.own_leads().is_empty() {
        state.load = load;
    } else {
        // A trajectory that ends in this tick still has its own lead.
        let lead = lead(p, trajectory_before.or(state.generator.plays()));
        state.load = each(|leg| load[leg] + (demand[leg] - state.demand[leg]) * lead);
    }
    state.demand = demand;
    if let Some(velocity_feedback) = &velocity_feedback {
        state.load = each(|leg| state.load[leg] + velocity_feedback[leg]);
    }
    let mut request = each(|leg| demand[leg] + state.load[leg] + reaction[leg]);
    if entered {
        bumpless_transfer(p, config, state, &request);
        request = each(|leg| state.legs[leg].requested);
    } else {
        state.transfer.fade(p.transfer_keep(), p.transfer_negligible());
        if state.transfer.is_active() {
            let offset = state.transfer.offset();
            request = each(|leg| request[leg] + offset[leg]);
        }
    }
    let mut limited = 0;
    for (index, (leg, table)) in state.legs.iter_mut().zip(p.tables()).enumerate() {
        let held_back = actuate(p, config, leg, table, request[index]);
        limited |= (held_back as u32) << index;
    }
    state.limited = limited != 0;
    let mut static_inverse = 0;
    for (index, leg) in state.legs.iter().enumerate() {
        let fell_back = config.mode.inverts() && leg.memory.fell_back();
        static_inverse |= (fell_back as u32) << (STATIC_INVERSE.trailing_zeros() as usize + index);
    }
    let inputs = if wrench_valid { 0 } else { WRENCH_FAULT } | if correction_limited { CORRECTION_LIMITED } else { 0 };
    static_inverse | limited | gauge_faults << GAUGE_FAULT.trailing_zeros() | setpoint_status | inputs
}

/// Lead of a trajectory, or of any other motion (none); in periods.
#[inline]
fn lead<P: Platform>(p: P, trajectory: Option<u32>) -> P::Real {
    match trajectory {
        Some(selector) if !p.own_leads().is_empty() => {
            p.own_leads().get(selector as usize).copied().unwrap_or(p.lead())
        }
        _ => p.lead(),
    }
}

/// Whether this tick is the first of its mode, or of its source of the interaction force. If so, the parts that the
/// mode does not use are reset, and the integral where the estimates begin. The first request then sets the offset that keeps the voltages unchanged.
#[inline]
fn enter_mode<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>) -> bool {
    let (mode, interaction) = (config.mode, config.interaction);
    let same_force = state.interaction == interaction
        && (interaction != Interaction::Modelled || state.environment == config.environment);
    if state.mode == Some(mode) && same_force {
        return false;
    }
    let adapted = match state.mode {
        Some(before) => before.law() != Law::Invhys,
        None => false,
    };
    // The estimates begin: the offset takes over what the integral held.
    if mode.law() != Law::Invhys && !adapted {
        state.integral = Integral::new();
        state.deflection = [P::Real::ZERO; 6];
    }
    state.mode = Some(mode);
    state.interaction = interaction;
    state.environment = config.environment;
    for estimate in &mut state.estimates {
        match mode.law() {
            Law::Invhys => *estimate = Estimate::new(),
            Law::Ewma => estimate.drift = P::Real::ZERO,
            Law::Pcc => {}
        }
    }
    for leg in &mut state.legs {
        leg.requested = requested_displacement(p, mode, leg);
        leg.excess = P::Real::ZERO;
    }
    state.limited = false;
    if mode.law() == Law::Invhys {
        state.innovation_notch = NotchState::new();
    }
    if !mode.damps_modes() {
        state.damping.rest();
    }
    if !mode.feeds_back() {
        state.integral = Integral::new();
        state.error_notch = NotchState::new();
        state.error = [P::Real::ZERO; 6];
        state.deflection = [P::Real::ZERO; 6];
    }
    true
}

/// Makes the change of mode bumpless: the difference between the last request and the first `request` of the new mode (m
/// of each leg) goes to the estimates, or to the integral if every axis has one. Otherwise it becomes an offset that
/// fades.
#[cold]
fn bumpless_transfer<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>, request: &[P::Real; LEGS]) {
    let held = each(|leg| state.legs[leg].requested - request[leg]);
    let mode = config.mode;
    let mut offset = [P::Real::ZERO; LEGS];
    if mode.law() != Law::Invhys {
        for (estimate, held) in state.estimates.iter_mut().zip(transform(p.legs_to_modes(), &held)) {
            estimate.level = estimate.level - held;
        }
    } else if mode.feeds_back() && config.active_gains().integral.iter().all(|gain| *gain > P::Real::ZERO) {
        state.integral.grow(&transform(p.legs_to_wrench(), &held));
    } else {
        offset = held;
    }
    state.transfer.begin(offset);
}

/// Enters or leaves a fallback stage. Active damping is reset, or its last request would remain as a pose error.
/// Integral and estimates stay.
#[cold]
#[inline(never)]
fn fall_back<P: Platform>(state: &mut State<P>, fallback: Fallback) {
    state.fallback = fallback;
    state.damping.rest();
    if fallback == Fallback::FeedForward {
        for estimate in &mut state.estimates {
            // The drift φ̂ would continue to change the level δ̂.
            *estimate = Estimate { level: estimate.correction(), drift: P::Real::ZERO };
        }
    }
}

/// Scales an error or innovation by the share of the fallback stage.
#[cold]
#[inline(never)]
fn weaken<T: Real>(fallback: Fallback, values: &mut [T; 6]) {
    let share: T = fallback.share();
    for value in values {
        *value = *value * share;
    }
}

/// When the set-point comes to rest, the estimates take over the integral; the request stays the same. Otherwise both
/// would drift against each other, since they act on the same error: the estimates take over the integral's deflection
/// at their rate, and the integral releases it at another, k_I/(K + k_p) on an axis of stiffness K.
#[cold]
fn integral_to_estimates<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>) {
    let mode = config.mode;
    if mode.feeds_back() && mode.law() != Law::Invhys {
        let held = transform(p.force_to_modes(), &state.integral.force);
        for (estimate, held) in state.estimates.iter_mut().zip(held) {
            estimate.level = estimate.level - held;
        }
        state.integral = Integral::new();
    }
}

/// Updates h and ḣ from the gauges, and returns a bit for each invalid gauge. If there is one, the last pose is held.
#[inline]
pub fn sense<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>, gauge: &[P::Real; 6]) -> u32 {
    let faults = faults(gauge, p.raw_limits());
    if faults == 0 {
        state.pose = sensing::pose(p, gauge);
    }
    if !config.damps() {
        state.rate.rest();
    } else if faults == 0 {
        state.rate.update(p.rate_filter(), &state.pose);
    } else {
        state.rate.coast(p.rate_filter());
    }
    faults
}

/// Updates from the readings: the integral of (7), the run-to-run estimates, and the request of active damping.
#[inline]
pub fn learn<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>) {
    let mode = config.mode;
    let error = modal_error(p, &difference(&state.generator.target().pose, &state.pose));
    let fallback = state.fallback;
    if mode.damps_modes() && fallback == Fallback::None {
        state.damping.update(p.damping(), &error);
    }
    if mode.feeds_back() {
        state.error = notch_error(p, &mut state.error_notch, &error);
        if fallback != Fallback::None {
            weaken(fallback, &mut state.error);
        }
        let growth = Integral::growth(&config.active_gains().integral, p.period(), &state.error);
        if !(state.limited && would_wind_up(p, &state.legs, &growth)) {
            state.integral.grow(&growth);
        }
    }
    if mode.law() != Law::Invhys {
        let disturbed = state.limited || state.transfer.is_active();
        let mut innovation = each(|k| -error[k] - state.deflection[k]);
        if disturbed {
            let offset = state.transfer.offset();
            let withheld = each(|leg| state.legs[leg].excess - offset[leg]);
            let withheld = transform(p.legs_to_modes(), &withheld);
            innovation = each(|k| innovation[k] + withheld[k]);
        }
        let mut innovation = notch_innovation(p, &mut state.innovation_notch, &innovation);
        if fallback != Fallback::None {
            weaken(fallback, &mut innovation);
        }
        let (level, drift) = (config.level_weight, config.drift_weight);
        Estimate::correct(&mut state.estimates, mode.law(), level, drift, &innovation);
    }
}

/// Whether the integral's growth would push a leg further beyond its active limit.
#[inline]
fn would_wind_up<P: Platform>(p: P, legs: &[LegState<P>; LEGS], growth: &[P::Real; 6]) -> bool {
    let excess = each(|leg| legs[leg].excess);
    winds_up(&excess, &transform(p.wrench_to_legs(), growth))
}

/// Stores the measured wrench if it is valid. Returns whether it is, or true if `config.interaction` does not use it.
#[inline]
fn take_wrench<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>, wrench: &[P::Real; 6]) -> bool {
    if config.interaction != Interaction::Measured {
        return true;
    }
    let valid = is_within(wrench, p.wrench_limit());
    if valid {
        state.wrench = *wrench;
    }
    valid
}

/// J⁻ᵀ k_v ė/k_a with ė = ḣ_d(t_n) − ḣ: m of each leg; none without k_v.
#[inline]
fn velocity_feedback<P: Platform>(p: P, config: &Config<P>, state: &State<P>) -> Option<[P::Real; LEGS]> {
    if !config.damps() {
        return None;
    }
    let mut error = difference(&state.generator.target().rate, state.rate.value());
    if state.fallback != Fallback::None {
        weaken(state.fallback, &mut error);
    }
    Some(transform(p.wrench_to_legs(), &force_of(&config.active_gains().derivative, &error)))
}

/// Leg displacements at the set-point, and the deflections of the legs there under inertia, gravity and the work piece
/// (7), m.
#[inline]
pub fn known_load<P: Platform>(p: P, config: &Config<P>, state: &State<P>) -> ([P::Real; LEGS], [P::Real; LEGS]) {
    let target = state.generator.target();
    let wrench = match config.interaction {
        Interaction::Neglected => {
            if let Some(affine) = p.affine_load() {
                return (leg_displacements(p, &target.pose), affine.deflection(target));
            }
            None
        }
        Interaction::Measured => Some(state.wrench),
        Interaction::Modelled => {
            let environment = &config.environment;
            Some(force_of(&environment.stiffness, &difference(&environment.rest, &target.pose)))
        }
    };
    let load = p.body().load(target, wrench.as_ref());
    let deflection = each(|leg| (load.force[leg] - p.rest_force()[leg]) * p.compliance());
    match p.cross_talk() {
        Some(cross_talk) => {
            let coupled = transform(cross_talk, &target.pose);
            (load.displacement, each(|leg| deflection[leg] + coupled[leg]))
        }
        None => (load.displacement, deflection),
    }
}

/// J⁻ᵀ(k_p e + s)/k_a − δ̂ − φ̂, plus active damping and J c: m of each leg.
#[inline]
pub fn reaction<P: Platform>(p: P, config: &Config<P>, state: &mut State<P>) -> [P::Real; LEGS] {
    if config.mode.feeds_back() {
        let proportional = force_of(&config.active_gains().proportional, &state.error);
        let integral = &state.integral.force;
        let force = each(|axis| proportional[axis] + integral[axis]);
        state.deflection = transform(p.force_to_modes(), &force);
    }
    let mut request = state.damping.add_to(each(|mode| state.deflection[mode] - state.estimates[mode].correction()));
    if let Some(correction) = state.correction.pose() {
        let correction = modal_error(p, &correction);
        request = each(|mode| request[mode] + correction[mode]);
    }
    transform(p.modes_to_legs(), &request)
}

/// Converts a request (m) to a permitted code, and applies the drive of that code to the leg's memory. Returns whether a
/// limit of table, voltage or slew rate held the leg back.
#[inline(never)]
pub fn actuate<P: Platform>(
    p: P,
    config: &Config<P>,
    leg: &mut LegState<P>,
    table: &P::Table,
    request: P::Real,
) -> bool {
    if config.mode.inverts() && track(p, config, leg, table, request) {
        return false;
    }
    actuate_limited(p, config, leg, table, request)
}

/// The fast path: no limit holds the leg back, and the drive stays in its cell of the table. Returns whether it applies;
/// if not, nothing has changed.
#[inline(always)]
fn track<P: Platform>(p: P, config: &Config<P>, leg: &mut LegState<P>, table: &P::Table, request: P::Real) -> bool {
    let previous = leg.code;
    let mut code = previous;
    let tracked = leg.memory.track(table, &mut leg.last, request, |drive| {
        code = p.dac().free_code(drive, previous, config.code_limits)?;
        Some(p.dac().drive(code))
    });
    if tracked {
        leg.code = code;
        leg.requested = leg.memory.displacement();
        leg.excess = P::Real::ZERO;
    }
    tracked
}

/// The general path of [`actuate`].
#[inline(never)]
fn actuate_limited<P: Platform>(
    p: P,
    config: &Config<P>,
    leg: &mut LegState<P>,
    table: &P::Table,
    request: P::Real,
) -> bool {
    let LegState { memory, code, .. } = leg;
    let mut limited = false;
    let mut permit = |drive: P::Real| {
        let (permitted, held_back) = p.dac().code(drive, *code, config.code_limits);
        *code = permitted;
        limited |= held_back;
        p.dac().drive(permitted)
    };
    if config.mode.inverts() {
        let out_of_reach = memory.follow_within(table, request, &mut permit);
        limited |= out_of_reach;
        leg.requested = leg.memory.displacement();
    } else {
        let drive = permit(request * p.cells_per_metre());
        memory.apply(table, drive);
        leg.requested = drive * p.metres_per_cell();
    }
    leg.excess = if limited { request - leg.requested } else { P::Real::ZERO };
    limited
}

/// Displacement that the present code requests, in the leg model of a mode, m.
#[inline]
fn requested_displacement<P: Platform>(p: P, mode: ControlMode, leg: &LegState<P>) -> P::Real {
    if mode.inverts() { leg.memory.displacement() } else { p.dac().drive(leg.code) * p.metres_per_cell() }
}
