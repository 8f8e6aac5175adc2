//! Design of P/F with active damping: gains, bandwidths, notches, and a second-order section for each mode, so that every loop bears any
//! single structural mode of the declared range. The design depends only on the platform: gains from the spec or set on a running
//! machine do not change the sections.
//!
//! In modal coordinates each mode is treated as a single-input single-output loop. The coupling by the gains of the axes is left to
//! the later check of the whole loop. With the sampled mode P, its notch N and e = 1 − z⁻¹,
//!
//! ```text
//! C = N κ + A N (1 + z⁻¹ N κ) + D        κ = k_p/K + T k_I/(K e) ;   A = (ω1 (e + z⁻¹ ω2) + ω2 e)/e² ;   S = 1/(1 + P C)
//! ```
//! D and N, and for the lowest mode of each group of coupled axes κ (for the first of them A, too), minimise a cost by CMA-ES. Targets
//! over stiffness, λ, lag, delay and damping: the largest |S| below 2; |1 + P C·H| ≥ 0.4 with any single structural mode H of the range;
//! a compliance peak below half of that without feedback; then tracking, compliance and noise. Bounds are penalties. If not all can be
//! met, the result is the best compromise, and the check of the whole loop decides.

use core::f64::consts::PI;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::notch::{Biquad, Notch, in_reach};
use super::structure::{DELAY, LAG, RATIO, STIFFNESS, StructureDemand};
use specgen_language::model::StoredDesign;
use specgen_numerics::nyquist::{Complex, FlexureRange, over, plus, sensitivity, square, times, tolerance};
use specgen_numerics::{Cma, Matrix6};
use specgen_runtime::Law;

/// Number of frequencies below, around and above the mode.
const POINTS: [u32; 3] = [40, 80, 60];
/// Target of the largest |S|: over the corners, and with a structural mode.
const SENSITIVITY: f64 = 1.95;
const WITH_STRUCTURE: f64 = 2.4;
/// Target of the compliance peak, relative to that without feedback: of modes up to [`LOW`] times the lowest, and of others.
const COMPLIANCE: [f64; 2] = [0.48, 1.0];
const LOW: f64 = 1.3;
/// Frequencies at which |S| of slow motion is compared with that of the start rule: the lowest mode over these.
pub const SLOW: [f64; 3] = [36.0, 7.2, 3.6];
/// Target of |S| at the first of them, relative to the start rule.
const SLOWEST: f64 = 1.15;
/// Target of |C| above this share of half the tick rate: what it amplifies of the gauge noise.
const FAST: f64 = 1.0;
const FAST_FROM: f64 = 0.4;
/// Weights of tracking and of compliance.
const TRACKING: f64 = 8.0;
const STIFF: f64 = 2.0;
/// Share of the error power of a path with corners that rings at the modes, under the start rule; the rest is slow.
const RINGING: f64 = 0.25;
/// Penalties for an unstable corner, and for the depth of a border in the range of structural modes.
const UNSTABLE: f64 = 1000.0;
const DEPTH: f64 = 20.0;
/// Share of the least ζ to which the sections alone are designed: with gains, the loop of one mode is not the whole.
const SPARE: f64 = 0.7;
/// Evaluations of the cost: for the lowest mode, with gains and bandwidths, and for others.
const EVALUATIONS: [usize; 2] = [3000, 2000];
const POPULATION: usize = 14;
const SEED: u64 = 49;
/// Raised when a change of this search makes other designs from the same values.
const VERSION: u32 = 1;

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
    /// Estimated error on a path with corners, relative to that of the start rule: |S| weighted with 1/f, and with the compliance.
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
pub struct DampedLaw {
    /// The section D of each mode.
    pub sections: [Biquad; 6],
    /// Damping ratio that the notch of each mode gives to it.
    pub notch_damping: [f64; 6],
    /// Gains and bandwidths.
    pub tuning: Tuning,
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
    /// What a spec stores, with the gains and bandwidths that the whole loop bears.
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
        (VERSION, basis, damping, [period, lag, gauge_lag], notch.is_some(), structure, adapting as u8, demand)
    );
    format!("d{}", &specgen_toolchain::sha256(text.as_bytes())[..16])
}

/// Gains and weights in the loop of one mode.
#[derive(Debug, Clone, Copy)]
struct Feedback {
    /// k_p/K and T k_I/K.
    gains: [f64; 2],
    /// ω1 and ω2 per tick.
    weights: [f64; 2],
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
    Scale::Logarithmic(0.1, 1.0),
    Scale::Linear(-0.6, 0.6),
    Scale::Linear(-0.6, 0.6),
    Scale::Linear(-0.6, 0.6),
    Scale::Logarithmic(0.4, 5.0),
    Scale::Logarithmic(0.05, 2.0),
];
/// Where a search starts: the start rule with a weak section.
const START: [f64; 6] = [0.9, 0.02, 0.0, 0.06, 1.5, 0.3];

/// Laws that this process has found, by digest: an editor compiles a spec after every key.
static FOUND: Mutex<BTreeMap<String, DampedLaw>> = Mutex::new(BTreeMap::new());

/// The law of a platform, from the start rule.
pub(super) fn search(of: &ClosedLoop, adapting: Law, start: &Tuning, demand: &StructureDemand) -> DampedLaw {
    let digest = digest(of, adapting, demand);
    let known = || FOUND.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(law) = known().get(&digest) {
        return law.clone();
    }
    let law = searched(of, adapting, start, demand);
    known().insert(digest, law.clone());
    law
}

fn searched(of: &ClosedLoop, adapting: Law, start: &Tuning, demand: &StructureDemand) -> DampedLaw {
    let mut law =
        DampedLaw { sections: [Biquad { b: [0.0; 3], a: [0.0; 2] }; 6], notch_damping: [1.0; 6], tuning: *start };
    let groups = groups(of);
    // Of each group, the factors of k_p and k_I; and those of Ω1 and Ω2.
    let mut gains: [Option<[f64; 2]>; 6] = [None; 6];
    let mut bandwidths: Option<[f64; 2]> = None;
    // Frequency, and what was found for it.
    let mut found: Vec<(f64, usize)> = Vec::new();
    for mode in 0..6 {
        let (frequency, group) = (of.basis.frequencies[mode], groups[mode]);
        if !in_reach(frequency, of.period) {
            continue;
        }
        let alike = found.iter().find(|(other, _)| (frequency - other).abs() < 1e-6 * frequency);
        if let Some(&(_, other)) = alike {
            gains[group] = gains[group].or(gains[groups[other]]);
            law.sections[mode] = law.sections[other];
            law.notch_damping[mode] = law.notch_damping[other];
            continue;
        }
        let family = Family::of(of, mode, adapting, Some(demand));
        let rule = family.figures(&family.controller(&family.feedback(start), START[0], None));
        let free = match (bandwidths, gains[group]) {
            (None, _) => 4,
            (Some(_), None) => 2,
            (Some(_), Some(_)) => 0,
        };
        let scales: Vec<Scale> = FACTORS[..free].iter().chain(&SECTION).copied().collect();
        let decode = |x: &[f64]| {
            let values: Vec<f64> = scales.iter().zip(x).map(|(scale, part)| scale.value(*part)).collect();
            let (own, section) = values.split_at(free);
            let [k_p, k_i] =
                gains[group].unwrap_or([own.first().copied().unwrap_or(1.0), own.get(1).copied().unwrap_or(1.0)]);
            let [level, drift] =
                bandwidths.unwrap_or([own.get(2).copied().unwrap_or(1.0), own.get(3).copied().unwrap_or(1.0)]);
            ([k_p, k_i, level, drift], section.to_vec())
        };
        let start_at: Vec<f64> = scales
            .iter()
            .zip([1.0].repeat(free).iter().chain(&START))
            .map(|(scale, value)| scale.part(*value))
            .collect();
        let cost = |x: &[f64]| {
            let (factors, section) = decode(x);
            let feedback = family.feedback(&scaled(start, factors));
            let figures = family.figures(&family.controller(&feedback, section[0], Some(&section[1..])));
            // The sections alone, for which gains without estimates are chosen later, and the estimates alone.
            let still = Feedback { gains: [0.0; 2], weights: [0.0; 2] };
            let still = family.controller(&still, section[0], Some(&section[1..]));
            let estimates = family.controller(&Feedback { gains: [0.0; 2], ..feedback }, section[0], None);
            figures.cost(&rule)
                + family.unborne(&still, family.spare_range.as_ref())
                + family.unborne(&estimates, family.bare_range.as_ref())
        };
        let best = minimise(&start_at, EVALUATIONS[usize::from(free < 4)], cost);
        let (factors, section) = decode(&best);
        gains[group] = Some([factors[0], factors[1]]);
        bandwidths = Some([factors[2], factors[3]]);
        law.notch_damping[mode] = section[0];
        law.sections[mode] = family.section(&section[1..]);
        found.push((frequency, mode));
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
            let rule = family.figures(&family.controller(&family.feedback(start), START[0], None));
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

/// Target of the compliance peak of the mode at ω, relative to that without feedback.
pub(super) fn target(of: &ClosedLoop, frequency: f64) -> f64 {
    COMPLIANCE[usize::from(frequency > LOW * of.basis.frequencies[0])]
}

/// The notch of a law.
pub(super) fn notch_of(of: &ClosedLoop, damping: &[f64; 6]) -> Option<Notch> {
    of.notch.as_ref().map(|notch| Notch {
        sections: core::array::from_fn(|mode| {
            let frequency = of.basis.frequencies[mode];
            if in_reach(frequency, of.period) {
                Biquad::notch(frequency, of.damping[mode], damping[mode], of.period)
            } else {
                Biquad::IDENTITY
            }
        }),
        ..notch.clone()
    })
}

fn minimise(start: &[f64], evaluations: usize, cost: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let mut cma = Cma::new(start, POPULATION, SEED);
    let mut best = (start.to_vec(), cost(start));
    let mut spent = 1;
    while spent < evaluations {
        let points = cma.ask();
        let costs: Vec<Option<f64>> = points.iter().map(|point| Some(cost(point))).collect();
        spent += points.len();
        for (point, value) in points.iter().zip(costs.iter().flatten()) {
            if *value < best.1 {
                best = (point.clone(), *value);
            }
        }
        cma.tell(&costs);
    }
    best.0
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

/// A mode under all its design conditions.
struct Family<'a> {
    of: &'a ClosedLoop,
    adapting: Law,
    mode: usize,
    frequency: f64,
    damping: f64,
    /// Hz and z⁻¹ at each frequency.
    hertz: Vec<f64>,
    delay: Vec<Complex>,
    /// |compliance|² without feedback, relative to the static compliance.
    open: Vec<f64>,
    nominal: Vec<Complex>,
    corners: Vec<Vec<Complex>>,
    /// The corners with each structural mode that is known but not part of the plant.
    suspects: Vec<Vec<Complex>>,
    /// With the distance of [`WITH_STRUCTURE`], and the border of stability itself.
    range: Option<FlexureRange>,
    bare_range: Option<FlexureRange>,
    spare_range: Option<FlexureRange>,
    /// Indices of [`SLOW`] in the list of frequencies.
    slow: [usize; 3],
    /// Share of the band up to half the tick rate that each frequency represents.
    width: Vec<f64>,
}

/// C times (1 − z⁻¹)ⁿ, and that factor.
struct Controller {
    response: Vec<Complex>,
    cancelled: Vec<Complex>,
}

struct Figures {
    /// Members of the family that are unstable.
    unstable: usize,
    sensitivity: [f64; 2],
    /// Largest |S| with a suspected mode, and depth of the border in the range of structural modes.
    suspected: f64,
    depth: f64,
    compliance: f64,
    most_compliance: f64,
    slow: [f64; 3],
    /// Power of slow errors and of ringing.
    tracking: [f64; 2],
    noise: f64,
    /// Largest |C| at high frequency.
    fast: f64,
}

impl Figures {
    /// Error on a path with corners over that of `rule`.
    fn tracking(&self, rule: &Self) -> f64 {
        let [slow, ringing] = core::array::from_fn(|k| self.tracking[k] / rule.tracking[k]);
        libm::sqrt((1.0 - RINGING) * slow + RINGING * ringing)
    }

    fn cost(&self, rule: &Self) -> f64 {
        let over = |value: f64, bound: f64| if value > bound { value - bound } else { 0.0 };
        let value = UNSTABLE * self.unstable as f64
            + 20.0 * over(self.sensitivity[1], SENSITIVITY)
            + 20.0 * over(self.suspected, WITH_STRUCTURE)
            + DEPTH * self.depth
            + 20.0 * over(self.compliance, self.most_compliance)
            + 100.0 * over(self.slow[0], SLOWEST * rule.slow[0])
            + 20.0 * over(self.noise, rule.noise)
            + 3.0 * over(self.fast, FAST)
            + TRACKING * self.tracking(rule)
            + STIFF * self.compliance;
        if value.is_finite() { value } else { f64::MAX }
    }
}

impl<'a> Family<'a> {
    /// Without a `demand` structural modes are left out.
    fn of(of: &'a ClosedLoop, mode: usize, adapting: Law, demand: Option<&StructureDemand>) -> Self {
        let (frequency, period) = (of.basis.frequencies[mode], of.period);
        let slow = SLOW.map(|share| of.basis.frequencies[0] / share);
        let angles = angles(frequency * period, slow.map(|one| one * period));
        let damping = of.damping[mode];
        let respond = |conditions: &Conditions, lag: f64| -> Vec<Complex> {
            let modes = of.modal_responses(conditions, lag, &angles);
            let plants = modes.iter().zip(&angles).map(|(modes, angle)| of.plant_at(modes, *angle)[(mode, mode)]);
            plants.map(|value| [value.re, value.im]).collect()
        };
        let nominal = respond(&Conditions::NOMINAL, 1.0);
        let mut corners = Vec::new();
        for stiffness in STIFFNESS {
            for lag in LAG {
                for delay in DELAY {
                    let conditions = Conditions { stiffness, damping: 0.7, delay, ..Conditions::NOMINAL };
                    let one = respond(&conditions, lag);
                    corners.extend(RATIO.map(|ratio| one.iter().map(|[re, im]| [ratio * re, ratio * im]).collect()));
                }
            }
        }
        let suspects = demand.map_or_else(Vec::new, |demand| {
            let with = |channel: &super::StructuralChannel, plant: &Vec<Complex>| {
                let factor =
                    |angle: &f64| channel.flexure.factor(angle / period / channel.frequency, channel.damping_ratio);
                plant.iter().zip(&angles).map(|(p, angle)| times(*p, factor(angle))).collect()
            };
            demand.suspects.iter().flat_map(|one| corners.iter().map(move |plant| with(one, plant))).collect()
        });
        let open = |angle: &f64| {
            let ratio = angle / (frequency * period);
            let (re, im) = (1.0 - ratio * ratio, 2.0 * damping * ratio);
            1.0 / (re * re + im * im)
        };
        let place = |wanted: f64| {
            angles.iter().position(|angle| *angle >= wanted * period * (1.0 - 1e-12)).unwrap_or(angles.len() - 1)
        };
        let width = (0..angles.len())
            .map(|k| {
                let next = angles.get(k + 1).unwrap_or(&angles[k]);
                let before = if k == 0 { 0.0 } else { angles[k - 1] };
                0.5 * (next - before) / PI
            })
            .collect();
        Self {
            of,
            adapting,
            mode,
            frequency,
            damping,
            hertz: angles.iter().map(|angle| super::loop_gain::hertz(*angle, period)).collect(),
            delay: angles.iter().map(|angle| [libm::cos(*angle), -libm::sin(*angle)]).collect(),
            open: angles.iter().map(open).collect(),
            nominal,
            corners,
            suspects,
            range: demand.map(|demand| demand.range(1.0 / WITH_STRUCTURE, 1.0)),
            bare_range: demand.map(|demand| demand.range(0.0, 0.98)),
            spare_range: demand.map(|demand| demand.range(0.0, SPARE)),
            slow: slow.map(place),
            width,
        }
    }

    /// Gains of the axes, projected on the mode, and weights.
    fn feedback(&self, tuning: &Tuning) -> Feedback {
        let (basis, mode) = (&self.of.basis, self.mode);
        let along = |gains: &[f64; 6]| {
            let coupled: Matrix6 = basis.couple(gains);
            coupled[mode][mode] / (self.frequency * self.frequency)
        };
        let period = self.of.period;
        Feedback {
            gains: [along(&tuning.proportional), along(&tuning.integral) * period],
            weights: [
                tuning.level_bandwidth * period,
                if self.adapting == Law::Pcc { tuning.drift_bandwidth * period } else { 0.0 },
            ],
        }
    }

    /// c₀ + c₁ s/ω + c₂ (s/ω)² over (s/ω)² + 2 ζ β s/ω + β², with β and ζ last.
    fn section(&self, x: &[f64]) -> Biquad {
        let &[c0, c1, c2, beta, zeta] = x else { return Biquad { b: [0.0; 3], a: [0.0; 2] } };
        let k = 1.0 / libm::tan(0.5 * self.frequency * self.of.period);
        let (square, line) = (beta * beta, 2.0 * zeta * beta * k);
        let scale = 1.0 / (k * k + line + square);
        Biquad {
            b: [
                (c0 + c1 * k + c2 * k * k) * scale,
                2.0 * (c0 - c2 * k * k) * scale,
                (c0 - c1 * k + c2 * k * k) * scale,
            ],
            a: [2.0 * (square - k * k) * scale, (k * k - line + square) * scale],
        }
    }

    /// C with the section of these numbers.
    fn controller(&self, feedback: &Feedback, notch_damping: f64, section: Option<&[f64]>) -> Controller {
        let section = section.map_or(Biquad { b: [0.0; 3], a: [0.0; 2] }, |x| self.section(x));
        self.with_section(feedback, notch_damping, &section)
    }

    fn with_section(&self, feedback: &Feedback, notch_damping: f64, section: &Biquad) -> Controller {
        let [proportional, integral] = feedback.gains;
        let [level, drift] = feedback.weights;
        let adapts = self.adapting != Law::Invhys && level > 0.0;
        let integrates = integral > 0.0;
        let drifts = adapts && drift > 0.0;
        let scaled = |factor: f64, value: Complex| [factor * value[0], factor * value[1]];
        let ones = |e: Complex, count: usize| (0..count).fold([1.0, 0.0], |power, _| times(power, e));
        let (of_gains, of_weights) = (usize::from(integrates), usize::from(adapts) + usize::from(drifts));
        let notch = match &self.of.notch {
            Some(_) => Biquad::notch(self.frequency, self.damping, notch_damping, self.of.period),
            None => Biquad::IDENTITY,
        };
        let (response, cancelled) = self
            .delay
            .iter()
            .map(|delay| {
                let e = [1.0 - delay[0], -delay[1]];
                let notch = of_section(&notch, *delay);
                // κ and A times their integrators.
                let kappa =
                    if integrates { plus(scaled(proportional, e), [integral, 0.0]) } else { [proportional, 0.0] };
                let fed_back = times(notch, kappa);
                let all = ones(e, of_gains + of_weights);
                let mut sum = times(fed_back, ones(e, of_weights));
                if adapts {
                    let estimates = if drifts {
                        plus(scaled(level, plus(e, scaled(drift, *delay))), scaled(drift, e))
                    } else {
                        [level, 0.0]
                    };
                    let seen = plus(ones(e, of_gains), times(*delay, fed_back));
                    sum = plus(sum, times(times(estimates, notch), seen));
                }
                (plus(sum, times(of_section(section, *delay), all)), all)
            })
            .unzip();
        Controller { response, cancelled }
    }

    /// Penalty for what a loop does not bear: a corner, or a structural mode of the range.
    fn unborne(&self, Controller { response, cancelled }: &Controller, range: Option<&FlexureRange>) -> f64 {
        let mut penalty = 0.0;
        let suspects = self.suspects.iter().map(|plant| (plant, None));
        for (plant, range) in self.corners.iter().map(|plant| (plant, range)).chain(suspects) {
            let found = tolerance(plant, response, cancelled, &self.hertz, range);
            penalty += if found.stable { DEPTH * found.depth } else { UNSTABLE };
        }
        penalty
    }

    fn figures(&self, Controller { response, cancelled }: &Controller) -> Figures {
        let (mut unstable, mut depth) = (0, 0.0);
        let mut largest = |plants: &[Vec<Complex>], range: Option<&FlexureRange>| {
            let mut most = 0.0;
            for plant in plants {
                let found = tolerance(plant, response, cancelled, &self.hertz, range);
                if found.sensitivity > most {
                    most = found.sensitivity;
                }
                if found.depth > depth {
                    depth = found.depth;
                }
                unstable += usize::from(!found.stable);
            }
            most
        };
        let worst = largest(&self.corners, self.range.as_ref());
        let suspected = largest(&self.suspects, None);
        let mut slow = [0.0; 3];
        let (mut nominal, mut compliance, mut noise, mut fast) = (0.0, 0.0, 0.0, 0.0);
        let mut tracking = [0.0; 2];
        let lowest = self.of.basis.frequencies[0] / core::f64::consts::TAU;
        let stable = sensitivity(&self.nominal, response, cancelled, |k, s| {
            if s > nominal {
                nominal = s;
            }
            if s * self.open[k] > compliance {
                compliance = s * self.open[k];
            }
            for (value, place) in slow.iter_mut().zip(self.slow) {
                if k == place {
                    *value = libm::sqrt(s);
                }
            }
            let gain = square(response[k]) / square(cancelled[k]);
            // T = P C S.
            noise += self.width[k] * square(self.nominal[k]) * gain * s;
            let relative = self.hertz[k] / lowest;
            tracking[0] += self.width[k] * s / (relative * relative);
            tracking[1] += self.width[k] * s * self.open[k];
            if self.delay[k][0] < libm::cos(FAST_FROM * PI) && gain > fast {
                fast = gain;
            }
        });
        unstable += usize::from(!stable);
        Figures {
            unstable,
            sensitivity: [libm::sqrt(nominal), worst],
            suspected,
            depth,
            // The open peak is 1/(2 ζ) of the static compliance, for small ζ.
            compliance: libm::sqrt(compliance) * 2.0 * self.damping * libm::sqrt(1.0 - self.damping * self.damping),
            most_compliance: target(self.of, self.frequency),
            slow,
            tracking,
            noise: libm::sqrt(noise),
            fast: libm::sqrt(fast),
        }
    }
}

/// ωT of every checked frequency, ascending to π: dense around the mode, and including `wanted`.
fn angles(mode: f64, wanted: [f64; 3]) -> Vec<f64> {
    let [below, about, above] = POINTS;
    let (low, high) = (0.6 * mode, if 1.6 * mode < PI { 1.6 * mode } else { 0.5 * (mode + PI) });
    let first = mode / 700.0;
    let geometric = |from: f64, to: f64, k: u32, count: u32| {
        from * libm::exp(libm::log(to / from) * f64::from(k) / f64::from(count))
    };
    let mut all: Vec<f64> = (0..below).map(|k| geometric(first, low, k, below)).collect();
    all.extend((0..about).map(|k| low + (high - low) * f64::from(k) / f64::from(about)));
    all.extend((0..=above).map(|k| if k == above { PI } else { geometric(high, PI, k, above) }));
    all.extend(wanted.into_iter().filter(|angle| *angle > first && *angle < PI));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| *a - *b < 1e-9 * *b);
    all
}

/// H(z⁻¹).
fn of_section(Biquad { b, a }: &Biquad, delay: Complex) -> Complex {
    let square = times(delay, delay);
    let sum = |first: f64, second: f64, third: f64| {
        [first + second * delay[0] + third * square[0], second * delay[1] + third * square[1]]
    };
    over(sum(b[0], b[1], b[2]), sum(1.0, a[0], a[1]))
}
