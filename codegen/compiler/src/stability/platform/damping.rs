//! Design of P/F with active damping: gains, bandwidths, notches, and a second-order section for each mode, so that every loop tolerates
//! any single structural mode of the declared range. The design depends only on the platform: gains from the spec or set on a running
//! machine do not change the sections.
//!
//! In modal coordinates each mode is treated as a single-input single-output loop. The coupling by the gains of the axes is left to
//! the later check of the whole loop. With the sampled mode P, its notch N and e = 1 − z⁻¹,
//!
//! ```text
//! C = N κ + A N (1 + z⁻¹ N κ) + D        κ = k_p/K + T k_I/(K e) ;   A = (ω1 (e + z⁻¹ ω2) + ω2 e)/e² ;   S = 1/(1 + P C)
//! ```
//! D and N of the lowest mode of a group of coupled axes and of its partner, the highest of about the same frequency, together with the κ
//! that they share (for the first group A, too), and then D and N of each other mode, minimise a cost by CMA-ES. Targets over stiffness,
//! λ, lag, delay and damping: the largest |S| below 2; |1 + P C·H| ≥ 0.4 with any single structural mode H of the range; a compliance
//! peak below half of that without feedback; then tracking, compliance and noise. Bounds are penalties. If not all can be met, the result
//! is the best compromise, and the check of the whole loop decides.

mod family;

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use super::closed_loop::ClosedLoop;
use super::law::Tuning;
use super::notch::{Biquad, in_reach};
use super::structure::StructureDemand;
use family::{Family, Feedback, Figures, LOW};
use specgen_language::model::StoredDesign;
use specgen_numerics::{Cma, ranked};
use specgen_runtime::Law;

pub use family::SLOW;
pub(super) use family::target;

/// Evaluations of the cost in each search: for the lowest modes, with gains and bandwidths, and for others.
const EVALUATIONS: [usize; 2] = [5000, 1500];
/// Each start has this part of them; the best goes on alone.
const STARTING: usize = 4;
const POPULATION: usize = 14;
const SEED: u64 = 49;
/// Raised when a change of this search makes other designs from the same values.
const VERSION: u32 = 2;

/// Effect of active damping on a mode; ratios.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DampedMode {
    /// Peak of the compliance (force to pose), relative to that without feedback.
    pub compliance: f64,
    /// Largest |S|: nominal, and over ±10 % of stiffness and λ, ±30 % of the amplifier's lag, one tick more, 0.7 of the damping.
    pub sensitivity: [f64; 2],
    /// |S| at 1/36, 1/7.2 and 1/3.6 of the lowest mode's frequency.
    pub slow: [f64; 3],
    /// The same without active damping, by the start rule.
    pub without: [f64; 3],
    /// Estimated error on a path with corners, relative to that of the start rule: from hysteresis, corners and ringing.
    pub tracking: f64,
}

/// Active damping of a platform.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActiveDamping {
    /// The section D of each mode.
    pub sections: [Biquad; 6],
    /// Effect on each mode; none for a mode that is too fast to be sampled.
    pub modes: [Option<DampedMode>; 6],
}

/// What the search finds, and a spec stores.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DampedLaw {
    /// The section D of each mode.
    pub(super) sections: [Biquad; 6],
    /// Damping ratio that the notch of each mode gives to it.
    pub(super) notch_damping: [f64; 6],
    /// Gains and bandwidths.
    pub(super) tuning: Tuning,
}

impl From<&StoredDesign> for DampedLaw {
    fn from(stored: &StoredDesign) -> Self {
        Self {
            sections: stored.sections.map(|[b0, b1, b2, a1, a2]| Biquad { b: [b0, b1, b2], a: [a1, a2] }),
            notch_damping: stored.notch_damping,
            tuning: Tuning {
                proportional: stored.proportional,
                integral: stored.integral,
                derivative: [0.0; 6],
                level_bandwidth: stored.level_bandwidth,
                drift_bandwidth: stored.drift_bandwidth,
            },
        }
    }
}

impl DampedLaw {
    /// What a spec stores, with the gains and bandwidths with which the whole loop is stable.
    pub(super) fn to_store(&self, digest: String, tuning: &Tuning) -> StoredDesign {
        StoredDesign {
            digest,
            sections: self.sections.map(|Biquad { b: [b0, b1, b2], a: [a1, a2] }| [b0, b1, b2, a1, a2]),
            notch_damping: self.notch_damping,
            proportional: tuning.proportional,
            integral: tuning.integral,
            level_bandwidth: tuning.level_bandwidth,
            drift_bandwidth: tuning.drift_bandwidth,
        }
    }
}

/// Digest of what a design depends on.
pub(super) fn digest(of: &ClosedLoop, adapting: Law, demand: &StructureDemand) -> String {
    let ClosedLoop { basis, damping, period, lag, gauge_lag, notch, structure, .. } = of;
    // Numbers in `{:?}` are written with all their digits.
    let text = format!(
        "{:?}",
        (
            VERSION,
            basis,
            damping,
            [period, lag, gauge_lag],
            notch.as_ref().map(|notch| notch.sections),
            structure,
            adapting as u8,
            demand
        )
    );
    format!("d{}", &specgen_toolchain::sha256(text.as_bytes())[..16])
}

/// A number of the search: from 0 to 1, either between two ends or between their logarithms.
#[derive(Debug, Clone, Copy)]
enum Scale {
    Linear(f64, f64),
    Logarithmic(f64, f64),
}

impl Scale {
    fn value(self, part: f64) -> f64 {
        match self {
            Self::Linear(low, high) => low + (high - low) * part,
            Self::Logarithmic(low, high) => low * libm::pow(high / low, part),
        }
    }

    fn part(self, value: f64) -> f64 {
        match self {
            Self::Linear(low, high) => (value - low) / (high - low),
            Self::Logarithmic(low, high) => libm::log(value / low) / libm::log(high / low),
        }
    }
}

/// Factors of k_p, k_I, Ω1 and Ω2 of the start rule.
const FACTORS: [Scale; 4] = [
    Scale::Logarithmic(0.02, 10.0),
    Scale::Logarithmic(0.05, 5.0),
    Scale::Logarithmic(0.1, 3.0),
    Scale::Logarithmic(0.25, 3.0),
];
/// Damping ratio of the notch; c₀, c₁, c₂, β and ζ of the section, see [`Family::section`].
const SECTION: [Scale; 6] = [
    Scale::Logarithmic(0.1, 2.0),
    Scale::Linear(-1.0, 1.0),
    Scale::Linear(-1.0, 1.0),
    Scale::Linear(-1.0, 1.0),
    Scale::Logarithmic(0.4, 5.0),
    Scale::Logarithmic(0.05, 2.0),
];
/// Where searches start, factors and section: the start rule with a weak section; and what is found for a platform like that of the
/// reference with structural modes from 1.7 times its lowest mode.
const STARTS: [([f64; 4], [f64; 6]); 2] =
    [([1.0; 4], [0.9, 0.02, 0.0, 0.06, 1.5, 0.3]), ([3.0, 1.45, 0.5, 0.8], [0.8, -0.5, 0.0, -0.15, 2.4, 0.6])];
/// The notch of the start rule.
const RULE: f64 = STARTS[0].1[0];

/// Laws that this process has found, by digest: an editor compiles a spec after every key.
static FOUND: Mutex<BTreeMap<String, DampedLaw>> = Mutex::new(BTreeMap::new());

/// The law of a platform, from the start rule; `digest`: that of what it depends on.
pub(super) fn search(
    of: &ClosedLoop,
    adapting: Law,
    start: &Tuning,
    demand: &StructureDemand,
    digest: &str,
) -> DampedLaw {
    let known = || FOUND.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(law) = known().get(digest) {
        return law.clone();
    }
    let law = searched(of, adapting, start, demand);
    known().insert(digest.to_owned(), law.clone());
    law
}

fn searched(of: &ClosedLoop, adapting: Law, start: &Tuning, demand: &StructureDemand) -> DampedLaw {
    let mut law =
        DampedLaw { sections: [Biquad { b: [0.0; 3], a: [0.0; 2] }; 6], notch_damping: [1.0; 6], tuning: *start };
    let groups = groups(of);
    // Of each group, the factors of k_p and k_I; and those of Ω1 and Ω2.
    let mut gains: [Option<[f64; 2]>; 6] = [None; 6];
    let mut bandwidths: Option<[f64; 2]> = None;
    // Modes whose section is found.
    let mut found: Vec<usize> = Vec::new();
    let frequencies = &of.basis.frequencies;
    let alike = |a: usize, b: usize| (frequencies[a] - frequencies[b]).abs() < 1e-6 * frequencies[a];
    for mode in 0..6 {
        let group = groups[mode];
        if found.contains(&mode) || !in_reach(frequencies[mode], of.period) {
            continue;
        }
        if let Some(&other) = found.iter().find(|other| alike(mode, **other)) {
            gains[group] = gains[group].or(gains[groups[other]]);
            law.sections[mode] = law.sections[other];
            law.notch_damping[mode] = law.notch_damping[other];
            continue;
        }
        // The gains must suit the lowest mode of a group, and the highest of those about it.
        let about = |other: &usize| {
            let near = frequencies[*other] < LOW * frequencies[mode] && in_reach(frequencies[*other], of.period);
            groups[*other] == group && near && !alike(mode, *other)
        };
        let partner = (mode + 1..6).rev().find(about).filter(|_| gains[group].is_none());
        let modes: Vec<usize> = [Some(mode), partner].into_iter().flatten().collect();
        let families: Vec<(Family, Figures)> = modes
            .iter()
            .map(|one| {
                let family = Family::of(of, *one, adapting, Some(demand));
                let rule = family.figures(&family.controller(&family.feedback(start), RULE, None));
                (family, rule)
            })
            .collect();
        let free = match (bandwidths, gains[group]) {
            (None, _) => 4,
            (Some(_), None) => 2,
            (Some(_), Some(_)) => 0,
        };
        // Modes that come later get the bandwidths that are found now: with the widest notch, they must bear the estimates.
        let later: Vec<Family> = (mode + 1..6)
            .filter(|other| bandwidths.is_none() && in_reach(frequencies[*other], of.period))
            .filter(|other| !modes.iter().any(|one| alike(*one, *other)))
            .map(|other| Family::of(of, other, adapting, Some(demand)))
            .collect();
        let sections = SECTION.repeat(modes.len());
        let scales: Vec<Scale> = FACTORS[..free].iter().chain(&sections).copied().collect();
        let decode = |x: &[f64]| {
            let values: Vec<f64> = scales.iter().zip(x).map(|(scale, part)| scale.value(*part)).collect();
            let (own, sections) = values.split_at(free);
            let [k_p, k_i] =
                gains[group].unwrap_or([own.first().copied().unwrap_or(1.0), own.get(1).copied().unwrap_or(1.0)]);
            let [level, drift] =
                bandwidths.unwrap_or([own.get(2).copied().unwrap_or(1.0), own.get(3).copied().unwrap_or(1.0)]);
            ([k_p, k_i, level, drift], sections.to_vec())
        };
        let starts = STARTS.map(|(factors, section)| -> Vec<f64> {
            let values = factors[..free].iter().copied().chain(section.repeat(modes.len()));
            scales.iter().zip(values).map(|(scale, value)| scale.part(value)).collect()
        });
        // Not counted further above `most`: cheap terms come first.
        let cost = |x: &[f64], most: f64| {
            let (factors, sections) = decode(x);
            let tuning = scaled(start, factors);
            let mut sum = 0.0;
            let sections = families.iter().zip(sections.chunks(SECTION.len()));
            let mut loops: Vec<_> = sections
                .clone()
                .map(|((family, rule), section)| {
                    let feedback = family.feedback(&tuning);
                    let controller = family.controller(&feedback, section[0], Some(&section[1..]));
                    let figures = family.nominal_figures(&controller);
                    sum += figures.cost(rule);
                    (controller, figures)
                })
                .collect();
            // The estimates alone, and the sections alone, for which gains without estimates are chosen later.
            let estimates =
                families.iter().map(|(family, _)| family).zip(sections.clone().map(|(_, section)| section[0]));
            for (family, notch_damping) in estimates.chain(later.iter().map(|family| (family, SECTION[0].value(1.0)))) {
                let alone = Feedback { gains: [0.0; 2], ..family.feedback(&tuning) };
                let alone = family.controller(&alone, notch_damping, None);
                sum += family.penalty(&alone, family.bare_range.as_ref(), most - sum);
            }
            for ((family, _), section) in sections.clone() {
                let still = Feedback { gains: [0.0; 2], weights: [0.0; 2] };
                let still = family.controller(&still, section[0], Some(&section[1..]));
                sum += family.penalty(&still, family.spare_range.as_ref(), most - sum);
            }
            for ((family, rule), (controller, figures)) in families.iter().zip(&mut loops) {
                let others = sum - figures.cost(rule);
                family.add_corners(controller, figures, |figures| others + figures.cost(rule) <= most);
                sum = others + figures.cost(rule);
            }
            sum
        };
        let best = minimise(&starts, EVALUATIONS[usize::from(free < 4)], cost);
        let (factors, sections) = decode(&best);
        gains[group] = Some([factors[0], factors[1]]);
        bandwidths = Some([factors[2], factors[3]]);
        for ((one, (family, _)), section) in modes.iter().zip(&families).zip(sections.chunks(SECTION.len())) {
            law.notch_damping[*one] = section[0];
            law.sections[*one] = family.section(&section[1..]);
            found.push(*one);
        }
    }
    let [level, drift] = bandwidths.unwrap_or([1.0; 2]);
    law.tuning.level_bandwidth *= level;
    law.tuning.drift_bandwidth *= drift;
    for axis in 0..6 {
        let mode = (0..6).find(|mode| of.basis.from_modal[axis][*mode] != 0.0);
        let [k_p, k_i] = mode.and_then(|mode| gains[groups[mode]]).unwrap_or([1.0; 2]);
        law.tuning.proportional[axis] *= k_p;
        law.tuning.integral[axis] *= k_i;
    }
    law
}

/// The effect of a law on each mode, against the start rule.
pub(super) fn effect(of: &ClosedLoop, adapting: Law, start: &Tuning, law: &DampedLaw) -> ActiveDamping {
    let modes = core::array::from_fn(|mode| {
        in_reach(of.basis.frequencies[mode], of.period).then(|| {
            let family = Family::of(of, mode, adapting, None);
            let rule = family.figures(&family.controller(&family.feedback(start), RULE, None));
            let responses =
                family.with_section(&family.feedback(&law.tuning), law.notch_damping[mode], &law.sections[mode]);
            let figures = family.figures(&responses);
            DampedMode {
                compliance: figures.compliance,
                sensitivity: figures.sensitivity,
                slow: figures.slow,
                without: rule.slow,
                tracking: figures.tracking(&rule),
            }
        })
    });
    ActiveDamping { sections: law.sections, modes }
}

/// The best point of searches from each start, of which only the best goes on after a part of the evaluations. `cost` may stop to count
/// above the number that it is given.
fn minimise(starts: &[Vec<f64>], evaluations: usize, cost: impl Fn(&[f64], f64) -> f64) -> Vec<f64> {
    let mut searches: Vec<_> =
        starts.iter().map(|start| (cost(start, f64::MAX), start.clone(), Cma::new(start, POPULATION, SEED))).collect();
    for part in [evaluations / STARTING, evaluations - evaluations / STARTING] {
        for (least, best, cma) in &mut searches {
            let mut spent = 0;
            while spent < part {
                let points = cma.ask();
                let half = points.len() / 2;
                spent += points.len();
                let mut costs: Vec<Option<f64>> = Vec::new();
                for point in points {
                    // Only the better half of a generation matters.
                    let most = ranked(&costs).get(half - 1).and_then(|at| costs[*at]).unwrap_or(f64::MAX);
                    let value = cost(&point, most);
                    costs.push(Some(value));
                    if value < *least {
                        (*least, *best) = (value, point);
                    }
                }
                cma.tell(&costs);
            }
        }
        searches.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
        searches.truncate(1);
    }
    searches.swap_remove(0).1
}

/// `start` with its k_p, k_I, Ω1 and Ω2 times the factors.
fn scaled(start: &Tuning, [k_p, k_i, level, drift]: [f64; 4]) -> Tuning {
    Tuning {
        proportional: start.proportional.map(|gain| gain * k_p),
        integral: start.integral.map(|gain| gain * k_i),
        level_bandwidth: start.level_bandwidth * level,
        drift_bandwidth: start.drift_bandwidth * drift,
        ..*start
    }
}

/// For each mode, the lowest mode with which it shares axes.
fn groups(of: &ClosedLoop) -> [usize; 6] {
    let mut group: [usize; 6] = core::array::from_fn(|mode| mode);
    for _ in 0..6 {
        for row in &of.basis.from_modal {
            let lowest = (0..6).filter(|mode| row[*mode] != 0.0).map(|mode| group[mode]).min();
            let Some(lowest) = lowest else { continue };
            (0..6).filter(|mode| row[*mode] != 0.0).for_each(|mode| group[mode] = lowest);
        }
    }
    group
}
