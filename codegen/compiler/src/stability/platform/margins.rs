//! Margins of a stable loop.

use core::f64::consts::{PI, TAU};

use serde::{Serialize, Serializer};

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::{LoopKind, Tuning};
use super::rule::is_stable;
use super::search::largest_stable;
use super::structure::{Border, Corners};
use super::{nominal_conditions, worst_radius};
use specgen_numerics::eigenvalues;
use specgen_runtime::ControlMode;

/// Upper ends of the search for margins.
const LARGEST_RATIO: f64 = 10.0;
const LARGEST_GAIN: f64 = 30.0;
const LARGEST_DELAY: f64 = 5.0;
/// Closed-loop modes with more damping than this are not listed.
const WELL_DAMPED: f64 = 0.5;

/// Margins of one control mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeMargins {
    /// The control mode, such as `P/F pcc`.
    #[serde(serialize_with = "by_name")]
    pub law: ControlMode,
    /// Largest spectral radius over gain_ratio, free and touching the declared work piece.
    pub spectral_radius: f64,
    /// λ = ρ/ρ̂ up to which the loop is stable; none: beyond 10.
    pub gain_ratio_limit: Option<f64>,
    /// Factor on all gains and bandwidths up to which the loop is stable; none: beyond 30, or a weight would pass 1.
    pub gain_margin: Option<f64>,
    /// Further delay up to which the loop is stable, ticks; none: beyond 5.
    pub delay_margin_ticks: Option<f64>,
    /// The same in s.
    pub delay_margin: Option<f64>,
    /// Time constant of the slowest closed-loop mode, s; none if the law has no feedback.
    pub settling: Option<f64>,
    /// Oscillating closed-loop modes with damping below 0.5, by frequency.
    pub modes: Vec<ClosedMode>,
    /// Damping ratio that a structural mode of the declared range needs at most.
    pub structure_damping: f64,
    /// For each kind of structural mode, the smallest damping ratio that it must have.
    pub borders: Vec<Border>,
}

/// A pair of closed-loop poles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClosedMode {
    /// |s| of s = ln z / T_s, Hz.
    pub frequency: f64,
    /// −Re s / |s|.
    pub damping_ratio: f64,
}

impl ModeMargins {
    pub(super) fn of(corners: &Corners, law: ControlMode, tuning: &Tuning, ratios: [f64; 2]) -> Self {
        let closed_loop = corners.closed_loop();
        let stable = |tuning: &Tuning, conditions: &Conditions| is_stable(closed_loop, law, tuning, conditions);
        let contacts = [false, true];
        let contacts = if closed_loop.environment == [0.0; 6] { &contacts[..1] } else { &contacts[..] };
        let everywhere = |tuning: &Tuning, conditions: Conditions| {
            contacts.iter().all(|&touching| stable(tuning, &Conditions { touching, ..conditions }))
        };
        // A limit that was not found is beyond the range.
        let inside = |found: Option<f64>, high: f64| found.filter(|x| *x < high);
        let gain_ratio_limit = inside(
            largest_stable(ratios[1], LARGEST_RATIO, 1.2, |gain_ratio| {
                everywhere(tuning, Conditions { gain_ratio, ..Conditions::NOMINAL })
            }),
            LARGEST_RATIO,
        );
        let largest_gain = {
            let fastest = if tuning.level_bandwidth > tuning.drift_bandwidth {
                tuning.level_bandwidth
            } else {
                tuning.drift_bandwidth
            };
            let whole = if fastest > 0.0 { 1.0 / (fastest * closed_loop.period) } else { LARGEST_GAIN };
            if whole < LARGEST_GAIN { whole } else { LARGEST_GAIN }
        };
        let gain_margin = inside(
            largest_stable(1.0, largest_gain, 1.2, |gain| everywhere(&tuning.scaled(gain, gain), Conditions::NOMINAL)),
            largest_gain,
        );
        // The search is over factors: 1 + delay, from 1 on.
        let delay_margin_ticks = inside(
            largest_stable(1.0, 1.0 + LARGEST_DELAY, 1.2, |x| {
                everywhere(tuning, Conditions { delay: x - 1.0, ..Conditions::NOMINAL })
            }),
            1.0 + LARGEST_DELAY,
        )
        .map(|x| x - 1.0);
        let loci = corners.loci(law, tuning);
        let (settling, modes) = closed_modes(closed_loop, law, tuning);
        Self {
            law,
            spectral_radius: worst_radius(closed_loop, law, tuning, &nominal_conditions(closed_loop, ratios)),
            gain_ratio_limit,
            gain_margin,
            delay_margin_ticks,
            delay_margin: delay_margin_ticks.map(|ticks| ticks * closed_loop.period),
            settling,
            modes,
            structure_damping: corners.needed(&loci),
            borders: corners.demand().flexures.iter().map(|flexure| corners.border(&loci, *flexure)).collect(),
        }
    }
}

fn by_name<S: Serializer>(mode: &ControlMode, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(mode)
}

/// Slowest time constant and weakly damped modes of the nominal loop.
fn closed_modes(closed_loop: &ClosedLoop, law: ControlMode, tuning: &Tuning) -> (Option<f64>, Vec<ClosedMode>) {
    let values = eigenvalues(&closed_loop.transition(law, tuning, &Conditions::NOMINAL)).unwrap_or_default();
    let mut slowest = 0.0;
    let mut modes = Vec::new();
    for (re, im) in values {
        let magnitude = libm::hypot(re, im);
        if magnitude == 0.0 {
            continue;
        }
        let (decay, turn) = (-libm::log(magnitude) / closed_loop.period, libm::atan2(im, re) / closed_loop.period);
        if decay > 0.0 && 1.0 / decay > slowest {
            slowest = 1.0 / decay;
        }
        let frequency = libm::hypot(decay, turn);
        // A negative real pole is half the tick rate, not a mode.
        if turn > 0.0 && turn < (1.0 - 1e-9) * PI / closed_loop.period && decay < WELL_DAMPED * frequency {
            modes.push(ClosedMode { frequency: frequency / TAU, damping_ratio: decay / frequency });
        }
    }
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency).then(a.damping_ratio.total_cmp(&b.damping_ratio)));
    let closed = LoopKind::of(law) != LoopKind::Open && slowest > 0.0;
    (closed.then_some(slowest), modes)
}
