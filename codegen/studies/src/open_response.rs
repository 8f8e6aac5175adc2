//! The response of an assembled platform in open drive: from the voltage of each leg to the six gauges, and what it shows.
//!
//! ```text
//! sweep of one leg after the other → Y/U by bins → fit of     H = G (I + s D + s² W)⁻¹ A⁻¹ Λ diag(c)
//! c = (1 − e^(−sT))/(sT) e^(−sT_d)/(1 + τ s) · e^(−jφ) (s/s₀)^(−γ)
//! ```
//! s = 2πjf; in modal coordinates of the spec W is mass, D damping over stiffness; A: legs per modal coordinate; Λ: displacements of
//! legs per volt, with joint stiffness and errors of gauges; G: structural modes of the gauges, those of legs are in c. Each leg has
//! its lag τ; the dead time T_d, the loss φ of small hysteresis loops and creep γ are common.
//! Linear least squares on (I + s D + s² W) H give starts, also if the machine is far off its spec.

mod fit;
mod health;
mod problem;
mod spectra;

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use specgen_compiler::compile::Compilation;
use specgen_identify::Parameter;

pub use health::{Change, Health, gain_of_strokes};
pub use spectra::{Sweep, SweepRecord};

/// What a response shows. Errors are standard errors by the noise, widened by what hysteresis and creep of small loops may hide.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OpenResponse {
    /// Six modes of the platform on its legs, in ascending order of frequency.
    pub modes: Vec<FoundMode>,
    /// Modes beyond those, in ascending order of frequency.
    pub others: Vec<OtherMode>,
    /// Lag of the amplifier of each leg, s, with the lag of the spec for the gauges taken off.
    pub lags: [f64; 6],
    /// Mean lag, s. Lag and dead time look alike far below 1/τ: only their sum is certain.
    pub lag: Parameter,
    /// Dead time beyond the hold of a tick, s.
    pub dead_time: Parameter,
    /// Mean lag and dead time, s.
    pub delay: Parameter,
    /// Small displacement of each leg per volt, m/V.
    pub gains: [f64; 6],
    /// Stiffness over mass, relative to that of the spec.
    pub stiffness_to_mass: Parameter,
    /// Damping ratios over those of the spec.
    pub damping: Parameter,
    /// Root mean square of what the fit leaves, over the size of the response.
    pub misfit: f64,
    /// Lowest and highest frequency used, Hz.
    pub band: [f64; 2],
}

/// A mode of the platform on its legs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FoundMode {
    /// Natural frequency, Hz.
    pub frequency: Parameter,
    /// ζ.
    pub zeta: Parameter,
    /// Frequency by the spec, Hz, and ζ.
    pub spec: [f64; 2],
}

/// A structural mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OtherMode {
    /// Natural frequency, Hz.
    pub frequency: Parameter,
    /// ζ.
    pub zeta: Parameter,
    /// Where it acts, as `at` of a `[[mode]]`, such as `gauge 2`.
    pub place: String,
    /// 1 in a leg.
    pub participation: Parameter,
    /// Whether the spec has it.
    pub known: bool,
}

impl OpenResponse {
    /// From one record a leg, in the order of the legs.
    ///
    /// # Errors
    /// Why there is none: a record does not show the leg, or the fit fails; one sentence.
    pub fn of(compiled: &Compilation, records: &[SweepRecord; 6]) -> Result<Self, String> {
        let bins = spectra::bins(records, compiled.model.timing.period)?;
        let problem =
            problem::Problem::new(compiled, &bins).ok_or("the spec has no platform whose gauges determine its pose")?;
        let fit = problem.searched()?;
        let found =
            problem.response(&fit).ok_or_else(|| "the records do not determine lag, modes and damping".to_owned())?;
        let [from, to] = found.band;
        match found.modes.iter().map(|mode| mode.frequency.value).find(|hertz| !(from..=to).contains(hertz)) {
            Some(hertz) => Err(format!("a mode at {hertz:.0} Hz is outside the sweeps, {from:.0} to {to:.0} Hz")),
            None => Ok(found),
        }
    }

    /// Lag and dead time of a leg, s.
    #[must_use]
    pub fn delay_of(&self, leg: usize) -> f64 {
        self.lags.get(leg).copied().unwrap_or_default() + self.dead_time.value
    }

    /// Delay of the modes well below them, 2ζ/ω of the lowest, s.
    #[must_use]
    pub fn modal_delay(&self) -> f64 {
        self.modes.first().map_or(0.0, |mode| 2.0 * mode.zeta.value / (TAU * mode.frequency.value))
    }
}

#[cfg(test)]
mod tests;
