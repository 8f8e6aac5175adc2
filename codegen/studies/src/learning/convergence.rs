//! Frequency up to which learning converges for every machine within the declared intervals.

use std::f64::consts::TAU;

use serde::Serialize;
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower;
use specgen_compiler::stability::platform::{
    ClosedLoop, Conditions, RestDynamics, StructuralChannel, StructureDemand, Tuning,
};
use specgen_numerics::nyquist::{Complex, Flexure, over, plus, square, times};
use specgen_runtime::{ControlMode, Law};

use super::response::Response;
use crate::factors::{Factor, Factors};
use specgen_numerics::Matrix6;
use specgen_numerics::complex6::{Matrix6c, inverse, larger, left, multiply, norm, spectral_radius};

/// Largest permitted spectral radius of Q (I − T L): the error of a pass relative to that of the pass before.
pub const LARGEST_RADIUS: f64 = 0.9;
/// Order of Q at its upper and at its lower end.
const ORDERS: [f64; 2] = [8.0, 4.0];
/// Smallest share of a correction that the loop must pass in every mode. Below it nothing is learned: there the feedback suffices.
const LEAST_LEFT: f64 = 0.004;
/// Frequency that counts as rest, relative to the lowest one tried.
const REST: f64 = 1e-3;
/// Candidate shares of the inverse: a smaller share learns more slowly, but tolerates more uncertainty.
const SHARES: [f64; 11] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0];
/// Share of the inverse of a measured T: legs with hysteresis answer a sweep and a correction of another size differently.
const MEASURED_SHARE: f64 = 0.7;
/// Ratio of one natural frequency to the next, of the unknown structural modes that are tried.
const FREQUENCY_STEP: f64 = 1.005;
/// Highest natural frequency that is tried, relative to the frequency of the correction.
const HIGHEST_MODE: f64 = 2.0;
/// Bandwidth that includes the lowest unknown structural mode, relative to its frequency.
const REACH: f64 = 1.5;
/// The bandwidth is rounded up to a multiple of this, Hz.
const REACH_STEP: f64 = 50.0;
/// Knots per period of f_c.
const KNOTS: f64 = 3.5;
/// Factor on the highest frequency, beyond which nothing is learned.
const JUST_BEYOND: f64 = 1.001;
/// Radius at which the full inverse is used.
const FAST: f64 = 0.5;
/// Number of frequencies between a hundredth of the highest one and the highest, and as many again around each mode.
const GRID: u32 = 160;
/// Half-width of the grid around a mode, relative to its frequency.
const ABOUT: f64 = 0.25;
/// Number of stiffness-to-mass ratios, evenly spaced, limits included.
const STIFFNESSES: u32 = 5;

/// A loop for which learning is possible.
#[derive(Debug, Clone)]
pub struct Learnable {
    pub(super) closed_loop: ClosedLoop,
    law: ControlMode,
    tuning: Tuning,
    /// τ, s.
    pub(super) lead: f64,
    /// Measured T of the machine, if any.
    measured: Option<Response>,
    /// Structural modes that the machine may have.
    unknown: StructureDemand,
}

/// Result of the convergence analysis for every machine within the intervals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// Lower end, below which the error is left to the feedback, and f_c, the upper end; Hz.
    pub band: [f64; 2],
    /// Largest bound of ρ(Q (I − T L)) over frequencies and machines.
    pub radius: f64,
    /// Frequency of the largest bound, Hz.
    pub at: f64,
    /// Whether T was measured: then the bound covers its uncertainty, else every machine within the intervals.
    pub measured: bool,
    /// Highest frequency requested, Hz.
    #[serde(skip)]
    pub(super) requested: f64,
    /// Lowest frequency of the measured T, Hz; infinite if none was measured.
    #[serde(skip)]
    pub(super) edge: f64,
    /// Delay of the T that is inverted, ticks: the middle of its interval, so that no machine is further from it than necessary.
    #[serde(skip)]
    pub(super) delay: f64,
    /// Lowest frequency of an unknown structural mode, Hz.
    #[serde(skip)]
    pub(super) unknown_from: f64,
    /// The bound without Q at frequencies (Hz) in ascending order.
    #[serde(skip)]
    pub bounds: Vec<[f64; 2]>,
    /// The share of T⁻¹ used at frequencies (Hz) in ascending order.
    #[serde(skip)]
    pub(super) shares: Vec<[f64; 2]>,
}

impl Convergence {
    /// Ticks between knots of a table that can hold what Q passes; `period` in s.
    pub fn spacing(&self, period: f64) -> u32 {
        spacing(self.band[1], period)
    }

    /// The band around the best-measured frequency in which learning with T⁻¹ converges for any T within three standard errors of the
    /// measurement, up to `requested` (Hz); `None` if there is none.
    fn measured(response: &Response, requested: f64) -> Option<Self> {
        let bins = &response.bins;
        let radii: Vec<f64> = bins.iter().map(|bin| 1.0 - MEASURED_SHARE + MEASURED_SHARE * bin.doubt()).collect();
        let inside = |k: &usize| bins[*k].hertz <= requested;
        let best = (0..radii.len()).filter(inside).min_by(|a, b| radii[*a].total_cmp(&radii[*b]))?;
        // NaN counts as not converging.
        let known = |k: &usize| radii[*k] <= LARGEST_RADIUS;
        if !known(&best) {
            return None;
        }
        let first = (0..best).rev().find(|k| !known(k)).map_or(0, |k| k + 1);
        let behind = (best..radii.len()).find(|k| !known(k)).unwrap_or(radii.len());
        let low = bins[first].hertz;
        // Outside the known band nothing is learned; there only Q applies.
        let learned = |k: usize| k >= first && k < behind;
        let radius = |k: usize| if learned(k) { radii[k] } else { 1.0 };
        let above: Vec<[f64; 2]> = (first..radii.len()).map(|k| [bins[k].hertz, radius(k)]).collect();
        // Nothing is known beyond the last bin.
        let end = [bins.last()?.hertz, 1.0];
        let high = highest_passed(above.into_iter().chain([end]), requested)?;
        if low >= high {
            return None;
        }
        let mut shares: Vec<[f64; 2]> = vec![[0.0, 0.0]];
        let share = |k: usize| if learned(k) { MEASURED_SHARE } else { 0.0 };
        shares.extend(bins.iter().enumerate().map(|(k, bin)| [bin.hertz, share(k)]));
        shares.push([JUST_BEYOND * end[0], 0.0]);
        let mut found = Self {
            band: [low, high],
            radius: 0.0,
            at: 0.0,
            measured: true,
            requested,
            edge: low,
            delay: 0.0,
            unknown_from: 0.0,
            bounds: Vec::new(),
            shares,
        };
        for (k, bin) in bins.iter().enumerate() {
            found.add_bound(bin.hertz, radius(k));
        }
        Some(found)
    }

    /// Adds a bound: `radius` is the factor per pass on the error at a frequency (Hz), without Q.
    fn add_bound(&mut self, hertz: f64, radius: f64) {
        self.bounds.push([hertz, radius]);
        let radius = radius * self.passed(hertz);
        if radius > self.radius {
            (self.radius, self.at) = (radius, hertz);
        }
    }

    /// |Q| at a frequency, Hz.
    pub fn passed(&self, hertz: f64) -> f64 {
        passed(self.band, hertz)
    }

    /// Frequency (Hz) up to which learning with a measured T is worth trying: the requested one, or beyond the unknown structural modes that
    /// ring first.
    pub fn reach(&self) -> f64 {
        let beyond = REACH_STEP * libm::ceil(REACH * self.unknown_from / REACH_STEP);
        if beyond > self.requested { beyond } else { self.requested }
    }

    /// |Q| at a frequency (Hz) if learning reached [`Self::reach`].
    pub(super) fn passed_at_reach(&self, hertz: f64) -> f64 {
        passed([self.band[0], self.reach()], hertz)
    }

    /// The share of T⁻¹ used at a frequency, Hz.
    pub(super) fn share(&self, hertz: f64) -> f64 {
        let above = self.shares.partition_point(|[at, _]| *at <= hertz);
        match (above.checked_sub(1).and_then(|below| self.shares.get(below)), self.shares.get(above)) {
            (Some([a, below]), Some([b, above])) => below + (above - below) * (hertz - a) / (b - a),
            (Some([_, share]), None) | (None, Some([_, share])) => *share,
            (None, None) => 1.0,
        }
    }
}

impl Learnable {
    /// The loop of a spec with `[control]` in its initial mode; `None` for six legs.
    pub fn of(compiled: &Compilation) -> Option<Self> {
        let (model, task) = (&compiled.model, compiled.model.task_space.as_ref()?);
        let design = compiled.design.as_ref()?;
        let closed_loop = design.closed_loop(model, task, &RestDynamics::of(&lower::platform(model).ok()?))?;
        let (law, tuning) = design.law(model, task);
        let unknown = StructureDemand::of(model, &closed_loop.basis);
        Some(Self { closed_loop, law, tuning: *tuning, lead: design.lead, measured: None, unknown })
    }

    pub(crate) fn closed_loop(&self) -> &ClosedLoop {
        &self.closed_loop
    }

    /// The initial control mode and its gains.
    pub(crate) fn law(&self) -> (ControlMode, &Tuning) {
        (self.law, &self.tuning)
    }

    /// S of the law that the spec starts with, at these frequencies (Hz), in pose coordinates.
    pub fn sensitivity(&self, hertz: &[f64]) -> Vec<Matrix6c> {
        let closed_loop = &self.closed_loop;
        let angles: Vec<f64> = hertz.iter().map(|hertz| TAU * hertz * closed_loop.period).collect();
        let complex = |matrix: &Matrix6| matrix.map(|row| row.map(|value| [value, 0.0]));
        let [from, to] = [&closed_loop.basis.from_modal, &closed_loop.basis.to_modal].map(complex);
        let modal = closed_loop.sensitivity(self.law, &self.tuning, &angles);
        modal.iter().map(|modal| multiply(&multiply(&from, modal), &to)).collect()
    }

    /// Natural frequencies of its modes, rad/s.
    pub fn modes(&self) -> [f64; 6] {
        self.closed_loop.basis.frequencies
    }

    /// The same loop with the measured T instead of the model's.
    #[must_use]
    pub fn with(self, measured: Response) -> Self {
        Self { measured: Some(measured), ..self }
    }

    /// T at frequencies (Hz), in modal coordinates.
    pub(super) fn response(
        &self,
        closed_loop: &ClosedLoop,
        conditions: &Conditions,
        frequencies: &[f64],
    ) -> Vec<Matrix6c> {
        let angles: Vec<f64> = frequencies.iter().map(|hertz| TAU * hertz * closed_loop.period).collect();
        closed_loop.correction_response(self.law, &self.tuning, conditions, &angles)
    }

    /// The same loop with gauges that read the pose itself, without modes on their mounts or the frame: for `--prepare`.
    pub(super) fn of_pose(&self) -> Self {
        let mut ideal = self.clone();
        ideal.closed_loop.structure.retain(|one| !one.on_readings());
        ideal
    }

    /// G: the response without feedback.
    pub(super) fn open_loop(&self, frequencies: &[f64]) -> Vec<Matrix6c> {
        let law = ControlMode::F(Law::Invhys);
        let open = Self { law, tuning: Tuning::NONE, lead: 0.0, measured: None, ..self.clone() };
        open.nominal(frequencies)
    }

    /// The T used for learning at frequencies (Hz) in ascending order: the model's below the edge, the measured one above.
    pub(super) fn known(&self, frequencies: &[f64], convergence: &Convergence) -> Vec<Matrix6c> {
        let slower = frequencies.partition_point(|hertz| *hertz < convergence.edge);
        let mut all = self.expected(&frequencies[..slower], convergence.delay);
        let measured =
            self.measured.iter().flat_map(|response| frequencies[slower..].iter().map(|hertz| response.at(*hertz)));
        all.extend(measured);
        all
    }

    /// T by the compiler's model, with a delay in ticks.
    pub(super) fn expected(&self, frequencies: &[f64], delay: f64) -> Vec<Matrix6c> {
        self.response(&self.closed_loop, &delayed(delay), frequencies)
    }

    /// T by the compiler's model.
    pub(super) fn nominal(&self, frequencies: &[f64]) -> Vec<Matrix6c> {
        self.expected(frequencies, 0.0)
    }

    /// The highest f_c up to `requested` (Hz) at which learning converges on every machine within `factors`, or for a measured T within its
    /// uncertainty; `None` if it converges at no frequency.
    pub fn convergence(&self, factors: &Factors, requested: f64) -> Option<Convergence> {
        if let Some(response) = &self.measured {
            return Some(self.extended_downwards(Convergence::measured(response, requested)?, factors, requested));
        }
        let frequencies = self.grid(requested);
        let (inverses, shares, radii) = self.modelled(&frequencies, factors);
        let highest =
            highest_passed(frequencies.iter().zip(&radii).map(|(hertz, radius)| [*hertz, *radius]), requested)?;
        let lowest = *frequencies.first()?;
        let answers = frequencies.iter().zip(&inverses).find(|(_, inverse)| responds(inverse));
        let low = answers.map_or(0.0, |(hertz, _)| self.lower_end(*hertz, lowest));
        if !(highest > lowest && highest > low) {
            return None;
        }
        let shares = frequencies.iter().zip(shares).map(|(hertz, share)| [*hertz, share]).collect();
        let mut found = Convergence {
            band: [low, highest],
            radius: 0.0,
            at: 0.0,
            measured: false,
            requested,
            edge: f64::INFINITY,
            delay: middle_delay(factors),
            unknown_from: self.unknown.from,
            bounds: Vec::new(),
            shares,
        };
        for (hertz, radius) in frequencies.iter().zip(&radii) {
            found.add_bound(*hertz, *radius);
        }
        Some(found)
    }

    /// Extends a measured band downwards with the model's T and the machines within `factors`. A sweep during a pass says little about slow
    /// motion: the feedback suppresses most of it. The model is reliable there, because mass and stiffness hardly matter.
    fn extended_downwards(&self, mut found: Convergence, factors: &Factors, requested: f64) -> Convergence {
        let frequencies: Vec<f64> = self.grid(requested).into_iter().filter(|hertz| *hertz < found.edge).collect();
        let (inverses, shares, radii) = self.modelled(&frequencies, factors);
        let learned = |k: &usize| radii[*k] <= LARGEST_RADIUS && responds(&inverses[*k]);
        // Lowest frequency of the band that ends where the measured one begins.
        let first = (0..frequencies.len()).rev().take_while(learned).last();
        let Some(first) = first else { return found };
        let slow = frequencies[first..].iter().zip(&shares[first..]).map(|(hertz, share)| [*hertz, *share]);
        let fast = found.shares.iter().copied().filter(|[hertz, _]| *hertz >= found.edge);
        let band = [self.lower_end(frequencies[first], frequencies[0]), found.band[1]];
        let shares = slow.chain(fast).collect();
        let (edge, delay) = (found.edge, middle_delay(factors));
        let bounds = std::mem::take(&mut found.bounds);
        let mut whole = Convergence { band, radius: 0.0, at: 0.0, bounds: Vec::new(), shares, delay, ..found };
        for (hertz, radius) in frequencies.iter().zip(&radii) {
            whole.add_bound(*hertz, *radius);
        }
        for [hertz, radius] in bounds.into_iter().filter(|[hertz, _]| *hertz >= edge) {
            whole.add_bound(hertz, radius);
        }
        whole
    }

    /// Lower end (Hz) of a band whose lowest frequency is `first`, where `lowest` is the lowest one tried: 0 if every mode responds at rest,
    /// else `first`. With integral action no mode responds at rest: T⁻¹ would turn the smallest constant error into a large constant
    /// correction, the fades at both ends of a pass would cut it off, and the next pass would learn from the remainder.
    fn lower_end(&self, first: f64, lowest: f64) -> f64 {
        let respond_at_rest = || self.nominal(&[REST * lowest]).iter().all(|response| responds(&inverse(response)));
        if first <= lowest && respond_at_rest() { 0.0 } else { first }
    }

    /// By the model, at each frequency (Hz): T⁻¹, the share of it used, and the largest radius over the machines within `factors`.
    fn modelled(&self, frequencies: &[f64], factors: &Factors) -> (Vec<Matrix6c>, Vec<f64>, Vec<f64>) {
        let delay = middle_delay(factors);
        let inverses: Vec<Matrix6c> = self.expected(frequencies, delay).iter().map(inverse).collect();
        let mut radii = self.with_unknown_modes(frequencies, delay);
        for (closed_loop, conditions) in self.machines(factors) {
            let real = self.response(&closed_loop, &conditions, frequencies);
            for ((radii, real), inverse) in radii.iter_mut().zip(&real).zip(&inverses) {
                let product = multiply(real, inverse);
                for (radius, share) in radii.iter_mut().zip(SHARES) {
                    // NaN means no convergence.
                    *radius = larger(*radius, spectral_radius(&left(&product, share)));
                }
            }
        }
        let chosen = radii.iter().map(|radii| {
            let least = (0..SHARES.len()).min_by(|a, b| radii[*a].total_cmp(&radii[*b])).unwrap_or(0);
            let index = if radii[0] <= FAST { 0 } else { least };
            (SHARES[index], radii[index])
        });
        let (shares, radii) = chosen.unzip();
        (inverses, shares, radii)
    }

    /// At each frequency (Hz) and for each share α of T⁻¹, the largest |1 − α F (1 + L)/(1 + F L)| over the structural modes that the
    /// spec permits: F is their factor on the plant, and L an eigenvalue of the open loop.
    fn with_unknown_modes(&self, frequencies: &[f64], delay: f64) -> Vec<[f64; SHARES.len()]> {
        let StructureDemand { from, damping_ratio, flexures, suspects } = &self.unknown;
        let angles: Vec<f64> = frequencies.iter().map(|hertz| TAU * hertz * self.closed_loop.period).collect();
        let loops = self.closed_loop.loci(self.law, &self.tuning, &delayed(delay), &angles);
        let at = |(hertz, loops): (&f64, [Complex; 6])| {
            let natural = std::iter::successors(Some(*from), |last| Some(last * FREQUENCY_STEP));
            let natural = natural.take_while(|one| one <= from || *one <= HIGHEST_MODE * hertz);
            let factor = |one: f64| flexures.iter().map(move |flexure| flexure.factor(hertz / one, *damping_ratio));
            let unknown = natural.flat_map(factor);
            let known = suspects.iter().map(|one| one.flexure.factor(TAU * hertz / one.frequency, one.damping_ratio));
            let mut radii = [0.0; SHARES.len()];
            for factor in unknown.chain(known) {
                for open in loops {
                    let grown = over(times(factor, plus([1.0, 0.0], open)), plus([1.0, 0.0], times(factor, open)));
                    for (radius, share) in radii.iter_mut().zip(SHARES) {
                        *radius = larger(*radius, libm::sqrt(square([1.0 - share * grown[0], -share * grown[1]])));
                    }
                }
            }
            radii
        };
        frequencies.iter().zip(loops).map(at).collect()
    }

    /// The nominal machine with one unknown structural mode of each kind, at the lowest frequency that the spec permits.
    pub(super) fn with_a_mode(&self, factors: &Factors) -> Vec<(ClosedLoop, Conditions)> {
        let StructureDemand { from, damping_ratio, flexures, .. } = &self.unknown;
        let machine = |flexure: &Flexure| {
            let (frequency, damping_ratio) = (TAU * from, *damping_ratio);
            let mut closed_loop = self.closed_loop.clone();
            closed_loop.structure.push(StructuralChannel { flexure: *flexure, frequency, damping_ratio, place: None });
            (closed_loop, delayed(middle_delay(factors)))
        };
        flexures.iter().map(machine).collect()
    }

    /// Frequencies up to where Q passes nothing, in ascending order, densest around the modes.
    pub(super) fn grid(&self, requested: f64) -> Vec<f64> {
        let highest = highest(requested, self.closed_loop.period);
        let share = |k: u32| f64::from(k) / f64::from(GRID - 1);
        let mut all: Vec<f64> = (0..GRID).map(|k| highest * libm::pow(1e-3, 1.0 - share(k))).collect();
        for mode in self.closed_loop.basis.frequencies {
            let hertz = mode / TAU;
            let about = (0..GRID).map(|k| hertz * (1.0 - ABOUT + 2.0 * ABOUT * share(k)));
            all.extend(about.filter(|hertz| *hertz < highest));
        }
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// Every corner of gain, stiffness over mass, damping, lag and delay.
    pub(super) fn machines(&self, factors: &Factors) -> Vec<(ClosedLoop, Conditions)> {
        let range = |factor| factors.range(factor);
        let ([soft, stiff], [light, heavy]) = (range(Factor::Stiffness), range(Factor::Mass));
        let [low, high] = [soft / heavy, stiff / light];
        let mut all = Vec::new();
        for lag in range(Factor::Lag) {
            let mut closed_loop = self.closed_loop.clone();
            closed_loop.lag *= lag;
            for k in 0..STIFFNESSES {
                let stiffness = low + (high - low) * f64::from(k) / f64::from(STIFFNESSES - 1);
                for gain_ratio in range(Factor::Gain) {
                    for damping in range(Factor::Damping) {
                        for delay in range(Factor::DelayTicks) {
                            let conditions = Conditions { gain_ratio, stiffness, damping, delay, touching: false };
                            all.push((closed_loop.clone(), conditions));
                        }
                    }
                }
            }
        }
        all
    }
}

/// Whether the loop passes enough of a correction in every mode, by its T⁻¹.
fn responds(inverse: &Matrix6c) -> bool {
    norm(inverse) * LEAST_LEFT <= 1.0
}

/// The middle of the interval of the delay, ticks.
fn middle_delay(factors: &Factors) -> f64 {
    let [low, high] = factors.range(Factor::DelayTicks);
    0.5 * (low + high)
}

/// The nominal machine with a delay in ticks.
fn delayed(delay: f64) -> Conditions {
    Conditions { delay, ..Conditions::NOMINAL }
}

/// The highest f_c up to `requested` (Hz) whose Q keeps the radius at each frequency (Hz) below the largest permitted; `None` if a radius is NaN.
fn highest_passed(radii: impl Iterator<Item = [f64; 2]>, requested: f64) -> Option<f64> {
    let mut highest = requested;
    for [hertz, radius] in radii {
        let excess = radius / LARGEST_RADIUS - 1.0;
        if excess.is_nan() {
            return None;
        }
        if excess > 0.0 {
            let bound = hertz / libm::pow(excess, 1.0 / ORDERS[0]);
            highest = if bound < highest { bound } else { highest };
        }
    }
    Some(highest)
}

/// Ticks between knots for learning up to a frequency, Hz; `period` in s.
pub(super) fn spacing(bandwidth: f64, period: f64) -> u32 {
    let apart = libm::floor(1.0 / (KNOTS * bandwidth * period));
    if apart >= 1.0 { apart as u32 } else { 1 }
}

/// Frequency (Hz) at which Q of f_c passes less than a ten-thousandth, or the highest that can be sampled well.
pub(super) fn highest(bandwidth: f64, period: f64) -> f64 {
    let (cut, fastest) = (3.2 * bandwidth, 0.45 / period);
    if cut < fastest { cut } else { fastest }
}

/// |Q| of a band (Hz) at a frequency, Hz.
fn passed([low, high]: [f64; 2], hertz: f64) -> f64 {
    let below = if low > 0.0 { 1.0 / (1.0 + libm::pow(low / hertz, ORDERS[1])) } else { 1.0 };
    below * low_pass(hertz, high)
}

/// |Q| at its upper end.
pub(super) fn low_pass(hertz: f64, bandwidth: f64) -> f64 {
    1.0 / (1.0 + libm::pow(hertz / bandwidth, ORDERS[0]))
}
