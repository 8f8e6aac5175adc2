//! Structural modes: those that are known, as part of the plant, and those that are not, as a range in which every loop must be stable.
//!
//! The border of stability of a mode in all six legs, or on all six readings, follows from the eigenvalues of the open loop
//! ([`Flexure::border`]). Where it does not enter the declared range of f_n and ζ, no single mode in it makes the loop unstable: a
//! mode far above the loop has no effect, and poles move continuously. A mode of one leg or one gauge, which has a smaller part in
//! every mode of the platform, is not judged by itself; simulations try it.

use core::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::channel::StructuralChannel;
use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::modes::ModalBasis;
use specgen_language::model::{Model, StructuralKind};
use specgen_numerics::nyquist::{Flexure, FlexureRange};
use specgen_numerics::{ComplexMatrix, Loci};
use specgen_runtime::ControlMode;

/// Corners at which a loop must tolerate a mode, besides the nominal point: stiffness, relative lag of the amplifier, delay in ticks.
const STIFFNESS: [f64; 2] = [0.9, 1.1];
const LAG: [f64; 2] = [0.7, 1.3];
const DELAY: [f64; 2] = [0.0, 1.0];
/// Damping ratios at a corner, relative to the nominal ones.
const DAMPING: f64 = 0.7;
/// λ at each corner.
pub(super) const RATIO: [f64; 2] = [0.9, 1.1];

/// Conditions and relative lag of the amplifier at each corner; [`RATIO`] multiplies their loops.
pub(super) fn corners() -> impl Iterator<Item = (Conditions, f64)> {
    let at = |stiffness: f64, lag: f64, delay: f64| {
        (Conditions { stiffness, damping: DAMPING, delay, ..Conditions::NOMINAL }, lag)
    };
    STIFFNESS
        .into_iter()
        .flat_map(move |stiffness| LAG.into_iter().flat_map(move |lag| DELAY.map(|delay| at(stiffness, lag, delay))))
}

/// Most damping of a structural mode: with more, it no longer rings.
const MOST_DAMPING: f64 = 0.3;
/// Frequencies of a border, from the lowest mode of the platform to half the tick rate.
const BINS: usize = 48;
/// Frequencies at which the open loop is computed, and those about each mode of the platform.
const POINTS: u32 = 200;
const ABOUT: u32 = 24;

/// What every loop must tolerate: any single structural mode of a range, and each of those that are suspected.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureDemand {
    /// Lowest frequency of an unknown mode, Hz.
    pub from: f64,
    /// Its least ζ.
    pub damping_ratio: f64,
    /// Where it may act.
    pub flexures: Vec<Flexure>,
    /// The resonance of a leg alone: each leg may have it, in addition to the stiffness of the model.
    pub suspects: Vec<StructuralChannel>,
}

impl StructureDemand {
    /// The range, with |1 + L·factor| ≥ `distance`, and ζ down to a `share` of the least.
    pub(super) fn range(&self, distance: f64, share: f64) -> FlexureRange {
        FlexureRange::new(self.from, share * self.damping_ratio, self.flexures.clone(), distance)
    }

    /// That of a spec.
    pub fn of(model: &Model, basis: &ModalBasis) -> Self {
        let declared = &model.structure;
        let flexure = |kind: &StructuralKind| match kind {
            StructuralKind::Leg => Flexure::Series,
            StructuralKind::Gauge => Flexure::Sensor(declared.gauge_participation),
            StructuralKind::Frame => Flexure::Sensor(declared.frame_participation),
        };
        Self {
            from: declared.from_hz(basis.frequencies[0] / TAU),
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

/// The smallest damping ratio with which one more structural mode leaves a control mode stable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Border {
    /// The kind of mode.
    pub kind: &'static str,
    /// Frequencies of the mode, Hz, ascending.
    pub frequencies: Vec<f64>,
    /// Smallest ζ from each to the next; zero where every damping is enough.
    pub damping_ratios: Vec<f64>,
}

impl Border {
    /// Of the intervals from the one about `from` (Hz) on, the one that demands the most damping: its lowest frequency, Hz, and that ζ.
    /// None if every damping is enough. The lowest frequency of the declared range begins an interval.
    pub fn worst(&self, from: f64) -> Option<[f64; 2]> {
        let both = self.frequencies.iter().zip(&self.damping_ratios).skip(self.interval(from).unwrap_or(0));
        both.filter(|(_, ratio)| **ratio > 0.0)
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map(|(frequency, ratio)| [*frequency, *ratio])
    }

    /// Number of the interval about a frequency, Hz; none below the lowest.
    fn interval(&self, frequency: f64) -> Option<usize> {
        self.frequencies.iter().rposition(|one| *one <= frequency)
    }
}

/// A structural mode with which a control mode is unstable.
pub(super) struct UnstableMode {
    kind: &'static str,
    /// Hz.
    frequency: f64,
    /// ζ that it needs.
    pub(super) needed: f64,
    /// In words, the ζ that it has or may have.
    given: String,
}

impl UnstableMode {
    /// In words.
    pub(super) fn describe(&self) -> String {
        let Self { kind, frequency, needed, given } = self;
        let needed = if *needed > MOST_DAMPING { format!("above {MOST_DAMPING}") } else { format!("{needed:.3}") };
        format!("a {kind} mode near {frequency:.0} Hz needs a damping ratio of {needed}, but {given}")
    }
}

type LastLoci = Vec<(ControlMode, Tuning, Arc<Loci>)>;

/// The plant at every corner and frequency, which all control modes share.
#[derive(Debug, Clone)]
pub struct Corners {
    of: ClosedLoop,
    demand: StructureDemand,
    angles: Vec<f64>,
    plants: Vec<Vec<ComplexMatrix>>,
    /// Of each control mode, the tuning of the last call of [`Corners::loci`] and its result: tuning rule, check and margins ask for
    /// the same.
    last: Arc<Mutex<LastLoci>>,
}

impl Corners {
    /// Those of a loop, with what it must tolerate.
    pub fn of(of: ClosedLoop, demand: StructureDemand) -> Self {
        let angles = angles(&of);
        let plants = std::iter::once((Conditions::NOMINAL, 1.0)).chain(corners()).map(|(conditions, lag)| {
            let modes = of.modal_responses(&conditions, lag, &angles);
            modes.iter().zip(&angles).map(|(modes, angle)| of.plant_at(modes, *angle)).collect()
        });
        let plants = plants.collect();
        Self { of, demand, angles, plants, last: Arc::default() }
    }

    /// The loop.
    pub fn closed_loop(&self) -> &ClosedLoop {
        &self.of
    }

    pub(super) fn demand(&self) -> &StructureDemand {
        &self.demand
    }

    pub(super) fn loci(&self, law: ControlMode, tuning: &Tuning) -> Arc<Loci> {
        let last = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((.., loci)) = last().iter().find(|(of, with, _)| *of == law && with == tuning) {
            return loci.clone();
        }
        let mut found = Loci::default();
        let controller = self.of.controller(law, tuning);
        for (k, &angle) in self.angles.iter().enumerate() {
            let controller = controller(angle);
            let frequency = super::loop_gain::hertz(angle, self.of.period);
            for (corner, plants) in self.plants.iter().enumerate() {
                found.include(frequency, &plants[k], &controller, if corner == 0 { &[1.0] } else { &RATIO });
            }
        }
        let found = Arc::new(found);
        let mut last = last();
        last.retain(|(of, ..)| *of != law);
        last.push((law, *tuning, found.clone()));
        found
    }

    /// The damping ratio that a mode of the range needs at most.
    pub(super) fn needed(&self, loci: &Loci) -> f64 {
        let range = [self.demand.from, 0.5 / self.of.period];
        let needs = self.demand.flexures.iter().map(|flexure| loci.demanded(*flexure, range)[1]);
        needs.fold(0.0, |most, one| if one > most { one } else { most })
    }

    /// Whether a control mode is stable with every structural mode that it must tolerate, by the border of stability.
    pub fn tolerates(&self, law: ControlMode, tuning: &Tuning) -> bool {
        let loci = self.loci(law, tuning);
        self.needed(&loci) <= self.demand.damping_ratio
            && self
                .demand
                .suspects
                .iter()
                .all(|one| self.border(&loci, one.flexure).at(one.frequency / TAU) < one.damping_ratio)
    }

    /// Of the modes that a control mode does not tolerate, the one that needs the most damping.
    pub(super) fn most_demanding(&self, law: ControlMode, tuning: &Tuning) -> Option<UnstableMode> {
        let loci = self.loci(law, tuning);
        let suspects = self.demand.suspects.iter().map(|one| {
            let frequency = one.frequency / TAU;
            let needed = self.border(&loci, one.flexure).at(frequency);
            let given = format!("has {}", one.damping_ratio);
            (needed >= one.damping_ratio, UnstableMode { kind: kind_of(one.flexure), frequency, needed, given })
        });
        let least = self.demand.damping_ratio;
        let ranges = self.demand.flexures.iter().map(|flexure| {
            let [frequency, needed] = loci.demanded(*flexure, [self.demand.from, 0.5 / self.of.period]);
            let given = format!("may have {least} (any from {:.0} Hz on)", self.demand.from);
            (needed > least, UnstableMode { kind: kind_of(*flexure), frequency, needed, given })
        });
        let all = ranges.chain(suspects).filter_map(|(is_unstable, one)| is_unstable.then_some(one));
        all.reduce(|most, one| if one.needed > most.needed { one } else { most })
    }

    /// The border of a control mode for one more structural mode.
    pub(super) fn border(&self, loci: &Loci, flexure: Flexure) -> Border {
        let lowest = self.of.basis.frequencies[0] / TAU;
        let highest = 0.5 / self.of.period;
        let at = |bin: usize| lowest * libm::pow(highest / lowest, bin as f64 / (BINS - 1) as f64);
        let mut frequencies: Vec<f64> = (0..BINS).map(at).collect();
        // Below it, no mode is declared: an interval about it would show damping that no mode of the range needs.
        let from = self.demand.from;
        frequencies.insert(frequencies.partition_point(|one| *one < from), from);
        Border { kind: kind_of(flexure), damping_ratios: loci.border(flexure, &frequencies), frequencies }
    }
}

/// The word of a spec for a kind of mode.
fn kind_of(flexure: Flexure) -> &'static str {
    match flexure {
        Flexure::Series => StructuralKind::Leg.word(),
        Flexure::Sensor(share) if share > 0.0 => StructuralKind::Gauge.word(),
        Flexure::Sensor(_) => StructuralKind::Frame.word(),
    }
}

impl Border {
    /// ζ in the interval about a frequency, Hz; zero below the lowest.
    pub(super) fn within(&self, frequency: f64) -> f64 {
        self.interval(frequency).map_or(0.0, |interval| self.damping_ratios[interval])
    }

    /// ζ at a frequency, Hz, and in the intervals beside it; zero above the highest, which no tick sees.
    pub(super) fn at(&self, frequency: f64) -> f64 {
        let Some(next) = self.frequencies.iter().position(|one| *one > frequency) else { return 0.0 };
        let near = &self.damping_ratios[next.saturating_sub(2)..=next];
        near.iter().fold(0.0, |most: f64, ratio| if *ratio > most { *ratio } else { most })
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
