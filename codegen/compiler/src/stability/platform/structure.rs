//! Structural modes: those that are known, as part of the plant, and those that are not, as a range in which every loop must be stable.
//!
//! The border of stability of a mode in all six legs, or on all six readings, follows from the eigenvalues of the open loop
//! ([`Flexure::border`]). A mode of one leg or one gauge closes a loop of one signal with all others closed: L/(1 + L) of that
//! leg or gauge stands in its place. Where these curves do not enter the declared range of f_n and ζ, no single mode in it makes
//! the loop unstable: a mode far above the loop has no effect, and poles move continuously.

use core::f64::consts::{PI, TAU};

use nalgebra::Complex;
use serde::Serialize;

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::loop_gain::{ComplexMatrix, loci};
use super::modes::ModalBasis;
use specgen_language::model::{Model, StructuralKind};
use specgen_numerics::nyquist::{Flexure, FlexureRange};
use specgen_runtime::ControlMode;

/// Corners at which a loop must bear a mode, besides the nominal point: stiffness, relative lag of the amplifier, delay in ticks, each
/// with 0.7 of the damping.
pub(super) const STIFFNESS: [f64; 2] = [0.9, 1.1];
pub(super) const LAG: [f64; 2] = [0.7, 1.3];
pub(super) const DELAY: [f64; 2] = [0.0, 1.0];
/// λ at each corner.
pub(super) const RATIO: [f64; 2] = [0.9, 1.1];
/// Lowest frequency of an unknown mode over that of the lowest mode of the platform, if the spec does not say.
const FROM: f64 = 2.5;
/// Most damping of a structural mode: with more, it no longer rings.
pub(super) const MOST_DAMPING: f64 = 0.3;
/// Frequencies of a border, from the lowest mode of the platform to half the tick rate.
const BINS: usize = 48;
/// Frequencies at which the open loop is computed, and those about each mode of the platform.
const POINTS: u32 = 200;
const ABOUT: u32 = 24;

/// What every loop must bear: any single structural mode of a range, and each of those that are suspected.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureDemand {
    /// Lowest frequency of an unknown mode, Hz, and its least ζ.
    pub from: f64,
    pub damping_ratio: f64,
    /// Where it may act.
    pub flexures: Vec<Flexure>,
    /// The resonance of a leg alone: each leg may have it, in addition to the stiffness of the model.
    pub suspects: Vec<StructuralChannel>,
}

impl StructureDemand {
    /// The range, with |1 + L·factor| ≥ `distance`.
    pub(super) fn range(&self, distance: f64) -> FlexureRange {
        FlexureRange::new(self.from, self.damping_ratio, self.flexures.clone(), distance)
    }

    /// That of a spec.
    #[must_use]
    pub fn of(model: &Model, basis: &ModalBasis) -> Self {
        let declared = &model.structure;
        let flexure = |kind: &StructuralKind| match kind {
            StructuralKind::Leg => Flexure::Series,
            StructuralKind::Gauge => Flexure::Sensor(declared.gauge_participation),
            StructuralKind::Frame => Flexure::Sensor(declared.frame_participation),
        };
        Self {
            from: declared.from.unwrap_or(FROM * basis.frequencies[0] / TAU),
            damping_ratio: declared.damping_ratio,
            flexures: declared.kinds.iter().map(flexure).collect(),
            suspects: vec![StructuralChannel {
                flexure: Flexure::Series,
                frequency: TAU * model.actuator.resonance,
                damping_ratio: model.actuator.damping_ratio,
                place: None,
            }],
        }
    }
}

/// A structural mode of the plant, in modal coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct StructuralChannel {
    /// Where it acts.
    pub flexure: Flexure,
    /// ω, rad/s.
    pub frequency: f64,
    /// ζ.
    pub damping_ratio: f64,
    /// The one leg or gauge it concerns, as a row that gives its coordinate and a column that gives its effect; none: all six.
    pub place: Option<([f64; 6], [f64; 6])>,
}

impl StructuralChannel {
    pub(super) fn on_readings(&self) -> bool {
        matches!(self.flexure, Flexure::Sensor(_))
    }

    /// The factor of the plant at ω, rad/s.
    pub(super) fn at(&self, frequency: f64) -> ComplexMatrix {
        let [re, im] = self.flexure.factor(frequency / self.frequency, self.damping_ratio);
        let factor = Complex::new(re, im);
        match &self.place {
            None => ComplexMatrix::from_diagonal_element(factor),
            Some((row, column)) => {
                ComplexMatrix::identity() + ComplexMatrix::from_fn(|i, j| (factor - 1.0) * column[i] * row[j])
            }
        }
    }
}

/// The smallest damping ratio with which one more structural mode of a kind leaves a control mode stable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Border {
    /// Frequencies of the mode, Hz, ascending.
    pub frequencies: Vec<f64>,
    /// Smallest ζ at each; zero where every damping is enough.
    pub damping_ratios: Vec<f64>,
    pub exact: f64,
}

impl Border {
    /// The most demanding frequency from `from` (Hz) on: it, and ζ there.
    #[must_use]
    pub fn worst(&self, from: f64) -> Option<[f64; 2]> {
        let both = self.frequencies.iter().zip(&self.damping_ratios);
        both.filter(|(frequency, ratio)| **frequency >= from && **ratio > 0.0)
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map(|(frequency, ratio)| [*frequency, *ratio])
    }

    /// The lowest frequency, Hz, from which on ζ = `damping_ratio` is enough; none if there is none.
    #[must_use]
    pub fn from(&self, damping_ratio: f64) -> Option<f64> {
        match self.damping_ratios.iter().rposition(|ratio| *ratio >= damping_ratio) {
            None => self.frequencies.first().copied(),
            Some(last) => self.frequencies.get(last + 1).copied(),
        }
    }
}

/// The plant at every corner and frequency, which all control modes share.
pub(super) struct Corners<'a> {
    of: &'a ClosedLoop,
    angles: Vec<f64>,
    plants: Vec<Vec<ComplexMatrix>>,
}

impl<'a> Corners<'a> {
    pub(super) fn of(of: &'a ClosedLoop) -> Self {
        let angles = angles(of);
        let corner = |stiffness: f64, damping: f64, delay: f64, lag: f64| {
            let conditions = Conditions { stiffness, damping, delay, ..Conditions::NOMINAL };
            let modes = of.modal_responses(&conditions, lag, &angles);
            modes.iter().zip(&angles).map(|(modes, angle)| of.plant_at(modes, *angle)).collect()
        };
        let mut plants = vec![corner(1.0, 1.0, 0.0, 1.0)];
        for stiffness in STIFFNESS {
            for lag in LAG {
                plants.extend(DELAY.map(|delay| corner(stiffness, 0.7, delay, lag)));
            }
        }
        Self { of, angles, plants }
    }

    pub(super) fn closed_loop(&self) -> &'a ClosedLoop {
        self.of
    }

    /// The border of a control mode for one more structural mode.
    pub(super) fn border(&self, law: ControlMode, tuning: &Tuning, flexure: Flexure) -> Border {
        let period = self.of.period;
        let lowest = self.of.basis.frequencies[0] / TAU;
        let highest = 0.5 / period;
        let at = |bin: usize| lowest * libm::pow(highest / lowest, bin as f64 / (BINS - 1) as f64);
        let mut border =
            Border { frequencies: (0..BINS).map(at).collect(), damping_ratios: vec![0.0; BINS], exact: 0.0 };
        let controllers: Vec<ComplexMatrix> =
            self.angles.iter().map(|angle| self.of.controller_at(law, tuning, *angle)).collect();
        for (corner, plants) in self.plants.iter().enumerate() {
            let ratios: &[f64] = if corner == 0 { &[1.0] } else { &RATIO };
            // A curve per eigenvalue is not continuous where two cross; its points are.
            for ((plant, controller), angle) in plants.iter().zip(&controllers).zip(&self.angles) {
                for value in loci(&(plant * controller)) {
                    for ratio in ratios {
                        let found = flexure.border([ratio * value.re, ratio * value.im], [0.0; 2]);
                        let Some([factor, damping]) = found else { continue };
                        if let Ok(x)=std::env::var("F0") && factor * angle / (TAU * period) > x.parse::<f64>().unwrap() && damping > border.exact {border.exact = damping;}
                        border.include(factor * angle / (TAU * period), damping);
                    }
                }
            }
        }
        border
    }
}

impl Border {
    fn include(&mut self, frequency: f64, damping: f64) {
        let Some(last) = self.frequencies.iter().rposition(|one| *one <= frequency) else { return };
        // Both ends of the interval, as the border is a line between bins.
        for bin in [last, last + 1] {
            if let Some(ratio) = self.damping_ratios.get_mut(bin)
                && damping > *ratio
            {
                *ratio = damping;
            }
        }
    }
}

/// ωT: dense about the modes of the platform, with 10 % of stiffness, and above them.
fn angles(of: &ClosedLoop) -> Vec<f64> {
    let (low, high) = (0.4 * of.basis.frequencies[0] * of.period, PI);
    let mut all: Vec<f64> =
        (0..=POINTS).map(|k| low * libm::pow(high / low, f64::from(k) / f64::from(POINTS))).collect();
    for frequency in of.basis.frequencies {
        let around = (0..ABOUT).map(|k| frequency * of.period * (0.93 + 0.14 * f64::from(k) / f64::from(ABOUT - 1)));
        all.extend(around.filter(|angle| *angle < PI));
    }
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| *a - *b < 1e-6 * *b);
    all
}
