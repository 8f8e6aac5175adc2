//! Stability and design of a platform controller, at compile time.
//!
//! The platform rests on six legs of axial stiffness k_a. Its modes and the lags of amplifiers and gauges limit the bandwidth of
//! feedback. This module computes the modes, designs the notch for them, chooses gains and bandwidths that the spec leaves out, and
//! checks every control mode that a running controller can be switched to: the spectral radius of one tick of the closed loop,
//! with the platform sampled exactly, over the declared interval of λ.
//!
//! Pose coordinates are x, y, z (m) and θx, θy, θz (rad) from rest. Not modelled: flexure stiffness, bending of legs, axial modes
//! inside a leg, hysteresis (represented by λ), dynamics of the gauges beyond a first-order lag.

mod channel;
mod closed_loop;
mod damping;
mod law;
mod loop_gain;
mod margins;
mod modes;
mod notch;
mod open_loop;
mod refusal;
mod report;
mod rest;
mod rule;
mod sampled;
mod search;
mod structure;

use serde::Serialize;
use specgen_runtime::{ControlMode, Law, Platform};

use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Gains, Interaction, Model, StoredDesign, TaskSpace};
use specgen_numerics::{Matrix6, jacobian, mass_matrix};

pub use super::LARGEST_RADIUS;
pub use channel::StructuralChannel;
pub use closed_loop::{ClosedLoop, Conditions};
use damping::DampedLaw;
pub use damping::{ActiveDamping, DampedMode, SLOW};
pub use law::{LoopKind, Tuning, start_law, start_mode};
pub use margins::{ClosedMode, ModeMargins};
pub use modes::ModalBasis;
pub use notch::{Biquad, Notch};
pub use report::{describe, describe_damping};
pub use rule::bandwidth_limit;
pub use structure::{Border, Corners, StructureDemand};

/// Number of λ values checked, evenly spaced over the interval, ends included.
const RATIOS: u32 = 5;

/// The platform at rest, in pose coordinates from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct RestDynamics {
    /// M(0), kg, kg m, kg m²; symmetric and positive definite.
    pub mass: Matrix6,
    /// J(0) = ∂l/∂h, one row a leg, 1 and m/rad.
    pub jacobian: Matrix6,
}

impl RestDynamics {
    /// M and J of the controller's own model at rest.
    pub fn of(platform: &Platform<f64>) -> Self {
        let mass = mass_matrix(platform, &[0.0; 6]);
        Self {
            // Made exactly symmetric for the modes.
            mass: core::array::from_fn(|i| core::array::from_fn(|j| 0.5 * (mass[i][j] + mass[j][i]))),
            jacobian: jacobian(platform, &[0.0; 6]),
        }
    }
}

/// Result of the analysis: numbers for lowering, figures for the user.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Modes of the free platform, by frequency.
    pub modes: [Mode; 6],
    /// Damping c_a of a leg, N s/m.
    pub leg_damping: f64,
    /// Lead τ of the feed-forward, s: from the spec, or [`lead`].
    pub lead: f64,
    /// Whether the lead is from the spec.
    pub lead_given: bool,
    /// Notch on feedback, if the spec has one.
    pub notch: Option<Notch>,
    /// Active damping of each mode in P/F, if the spec enables it.
    pub damping: Option<ActiveDamping>,
    /// What `[control.design]` may hold, and whether it had to be searched.
    #[serde(skip)]
    pub stored: Option<StoredDesign>,
    /// Whether the law was searched, as the spec stores none.
    #[serde(skip)]
    pub searched: bool,
    /// Lowest frequency of a structural mode that every control mode must tolerate, Hz.
    pub structure_from: f64,
    /// Ω, rad/s: level bandwidth at which EWMA alone becomes unstable.
    pub bandwidth_limit: f64,
    /// Bandwidths of F and P/F, and gains of P/F with estimates, from the spec or from the rule.
    pub combined: Tuning,
    /// Gains of P and of P/F with Invhys; the bandwidths are zero.
    pub position: Tuning,
    /// Whether the check includes contact with the declared work piece.
    pub touching: bool,
    /// Margins of every control mode.
    pub margins: Vec<ModeMargins>,
    /// Warnings and notes about small margins.
    #[serde(skip)]
    pub findings: Vec<Diagnostic>,
}

/// A mode of the platform on its legs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mode {
    /// ω, rad/s.
    pub frequency: f64,
    /// ζ.
    pub damping_ratio: f64,
    /// In pose coordinates, mass-normalised: Vᵀ M V = I.
    pub shape: [f64; 6],
}

/// Finds modes, notch, gains and margins of the platform of `model`, whose `[control]` is `task`.
///
/// # Errors
/// A platform without six modes, or an unstable control mode: at the responsible key, with a stable value.
pub fn design(model: &Model, task: &TaskSpace, plant: &RestDynamics) -> Result<Design, Vec<Diagnostic>> {
    let Some(mut closed_loop) = closed_loop_of(model, task, plant) else {
        return Err(vec![refusal::no_modes(model)]);
    };
    let ratios = model.adaptation.gain_ratio;
    let limit = bandwidth_limit(&closed_loop);
    let demand = StructureDemand::of(model, &closed_loop.basis);
    let given = task.gains.as_ref().map(gains);
    let given = rule::TuningKeys { gains: given.as_ref(), bandwidths: task.adaptation };
    if let Some(found) = refusal::too_low(model, &closed_loop, &demand) {
        return Err(vec![found]);
    }
    // A law without estimates has the sections of PCC: its gains are chosen for them afterwards.
    let adapting = if start_law(model) == Law::Invhys { Law::Pcc } else { start_law(model) };
    let digest = damping::digest(&closed_loop, adapting, &demand);
    let stored = task.design.as_ref().filter(|design| design.digest == digest);
    let mut searched = false;
    let damping = task.active_damping.then(|| {
        searched = stored.is_none();
        rule::damped(&mut closed_loop, limit, adapting, stored.map(DampedLaw::from), &demand, &digest)
    });
    let corners = Corners::of(closed_loop, demand);
    let (closed_loop, demand) = (corners.closed_loop(), corners.demand());
    let start = damping.as_ref().map(|(_, law)| &law.tuning);
    let combined = rule::combined(&corners, limit, given, start, ratios);
    let position = task.position_gains.as_ref().map_or_else(|| rule::alone(&corners, limit, ratios), gains);
    refusal::check(model, task, &corners, &combined, &position)?;
    let effect = damping.as_ref().map(|(start, law)| {
        let law = DampedLaw { tuning: combined, ..law.clone() };
        damping::effect(closed_loop, adapting, start, &law)
    });
    let margins: Vec<ModeMargins> = ControlMode::all()
        .map(|law| {
            let tuning = if law.uses_position_gains() { &position } else { &combined };
            ModeMargins::of(&corners, law, tuning, ratios)
        })
        .collect();
    let mut findings = refusal::thin(model, task, closed_loop, &margins);
    findings.extend(task.design.as_ref().filter(|_| stored.is_none()).map(|_| refusal::stale(model)));
    findings.extend(effect.as_ref().and_then(|damping| refusal::hardly_damped(model, closed_loop, damping)));
    let basis = &closed_loop.basis;
    Ok(Design {
        modes: core::array::from_fn(|i| Mode {
            frequency: basis.frequencies[i],
            damping_ratio: closed_loop.damping[i],
            shape: core::array::from_fn(|axis| basis.from_modal[axis][i]),
        }),
        leg_damping: 2.0 * task.modal_damping / basis.frequencies[0] * model.actuator.axial_stiffness,
        lead: lead(model, task, basis),
        lead_given: task.lead.is_some(),
        notch: closed_loop.notch.clone(),
        stored: damping.as_ref().map(|(_, law)| law.to_store(digest, &combined)),
        searched,
        damping: effect,
        structure_from: demand.from,
        bandwidth_limit: limit,
        combined,
        position,
        touching: closed_loop.environment != [0.0; 6],
        margins,
        findings,
    })
}

/// Lead τ of the spec, or else the delay of the pose behind a slow command, s, not below zero.
///
/// The amplifier delays by its lag, and every mode by 2 ζ/ω, the slope of its phase, which is the same for all with c_a = β k_a. A
/// voltage is held over a period, half a period late on average, but it commands the pose at the end of the period. So half a
/// period is subtracted.
pub fn lead(model: &Model, task: &TaskSpace, basis: &ModalBasis) -> f64 {
    task.lead.unwrap_or_else(|| {
        let late = model.amplifier.lag + 2.0 * task.modal_damping / basis.frequencies[0] - 0.5 * model.timing.period;
        if late > 0.0 { late } else { 0.0 }
    })
}

impl Design {
    /// The law at start-up, and its tuning.
    pub fn law(&self, model: &Model, task: &TaskSpace) -> (ControlMode, &Tuning) {
        let mode = start_mode(model, task);
        (mode, self.tuning(mode))
    }

    /// The numbers of a mode.
    pub fn tuning(&self, mode: ControlMode) -> &Tuning {
        if mode.uses_position_gains() { &self.position } else { &self.combined }
    }

    /// The closed loop of the spec without tuning; `task` is its `[control]`.
    pub fn closed_loop(&self, model: &Model, task: &TaskSpace, plant: &RestDynamics) -> Option<ClosedLoop> {
        let active_damping = self.damping.as_ref().map(|damping| damping.sections);
        closed_loop_of(model, task, plant).map(|closed_loop| ClosedLoop {
            active_damping,
            notch: self.notch.clone(),
            ..closed_loop
        })
    }
}

/// The closed loop of a spec without tuning and active damping; none if the platform does not have six modes.
pub fn closed_loop_of(model: &Model, task: &TaskSpace, plant: &RestDynamics) -> Option<ClosedLoop> {
    let basis = ModalBasis::of(plant, model.actuator.axial_stiffness)?;
    // c_a = β k_a with β = 2 ζ/ω_1: damping grows with frequency.
    let damping = basis.frequencies.map(|frequency| task.modal_damping * frequency / basis.frequencies[0]);
    let period = model.timing.period;
    let structure = channel::known(model, task, &basis, &plant.jacobian);
    let notch = task.notch_damping.map(|ratio| Notch::of(&basis, &damping, &[ratio; 6], period));
    Some(ClosedLoop {
        basis,
        damping,
        period,
        lag: model.amplifier.lag,
        gauge_lag: model.sensor.lag,
        notch,
        active_damping: None,
        structure,
        velocity_cutoff: task.velocity_cutoff,
        environment: task.environment.stiffness,
        measured: task.interaction == Interaction::Measured,
    })
}

fn gains(gains: &Gains) -> Tuning {
    Tuning {
        proportional: gains.proportional,
        integral: gains.integral,
        derivative: gains.derivative,
        level_bandwidth: 0.0,
        drift_bandwidth: 0.0,
    }
}

/// Conditions under which every control mode must be stable: λ over its interval, free and touching the declared work piece.
fn nominal_conditions(closed_loop: &ClosedLoop, [low, high]: [f64; 2]) -> Vec<Conditions> {
    let contacts: &[bool] = if closed_loop.environment == [0.0; 6] { &[false] } else { &[false, true] };
    let mut all = Vec::new();
    for &touching in contacts {
        for k in 0..RATIOS {
            let gain_ratio = low + (high - low) * f64::from(k) / f64::from(RATIOS - 1);
            all.push(Conditions { gain_ratio, touching, ..Conditions::NOMINAL });
        }
    }
    all
}

fn worst_radius(closed_loop: &ClosedLoop, law: ControlMode, tuning: &Tuning, conditions: &[Conditions]) -> f64 {
    let mut largest = 0.0;
    for one in conditions {
        let radius = closed_loop.spectral_radius(law, tuning, one);
        if radius > largest {
            largest = radius;
        }
    }
    largest
}
