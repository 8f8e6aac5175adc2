//! Fit of the platform and its structural modes to the open loop P or the closed loop T.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower::{leg_jacobian, poses_per_reading};
use specgen_identify::Parameter;
use specgen_numerics::complex6::{Matrix6c, add_product, dot, inverse, left, multiply, sum, weighted};
use specgen_numerics::nyquist::{Complex, Flexure, over, square, times};
use specgen_numerics::{Matrix6, multiply6};

use super::super::convergence::Learnable;
use super::super::response::Bin;
use super::{Location, StructuralMode};

/// Number of parameters of the platform: W, D, λ, dead time and lag; index of the first of each.
const PLATFORM: usize = 50;
const DAMPING: usize = 36;
const GAINS: usize = 42;
const DEAD_TIME: usize = 48;
const LAG: usize = 49;
/// Expected deviations of W, D, λ, dead time and lag (both in periods) from the spec: they keep what the record does not show near it.
const EXPECTED: [f64; 5] = [0.5, 0.03, 0.3, 1.0, 3.0];
/// Lowest frequency used, over that of the lowest mode of the platform.
const LOWEST: f64 = 0.4;
/// Deviation of a machine from the linear model, relative to the response: hysteresis depends on amplitude and history.
const NONLINEAR: f64 = 0.02;
/// Limits of a fitted damping ratio.
pub(crate) const RATIO: [f64; 2] = [5e-4, 0.4];

/// The frequency response and its surroundings at one frequency.
pub(super) struct Point {
    pub(super) hertz: f64,
    /// T as measured, and 1 over the standard deviation of each real number.
    closed: Matrix6c,
    weights: [[f64; 6]; 6],
    /// The same of P, computed from it. Where the loop suppresses noise, P has more of it, and is biased.
    pub(super) plant: Matrix6c,
    pub(super) plant_weights: [[f64; 6]; 6],
    /// T₀⁻¹ − P₀⁻¹.
    feedback: Matrix6c,
    /// R.
    rest: Matrix6c,
}

/// A mode that is fitted: ln f_n, ln ζ, a.
#[derive(Clone, Copy)]
pub(crate) struct Resonance {
    pub(crate) place: Location,
    pub(crate) values: [f64; 3],
}

impl Resonance {
    /// h at a frequency, Hz.
    pub(crate) fn factor(&self, hertz: f64) -> Complex {
        let [frequency, ratio, part] = self.values;
        let flexure = if self.place.on_gauges() { Flexure::Sensor(part) } else { Flexure::Series };
        flexure.factor(hertz / libm::exp(frequency), libm::exp(ratio))
    }

    /// Derivatives of ln h by its free parameters.
    pub(crate) fn slopes(&self, hertz: f64) -> Vec<Complex> {
        let step = 1e-6;
        let slope = |k: usize| {
            let [up, down] = [step, -step].map(|by| {
                let mut mode = *self;
                mode.values[k] += by;
                mode.factor(hertz)
            });
            over([0, 1].map(|part| (up[part] - down[part]) / (2.0 * step)), self.factor(hertz))
        };
        (0..self.free()).map(slope).collect()
    }

    pub(crate) fn of_leg(&self, leg: usize) -> bool {
        self.place == Location::Legs || self.place == Location::Leg(leg)
    }

    pub(crate) fn of_gauge(&self, gauge: usize) -> bool {
        self.place == Location::Gauges || self.place == Location::Gauge(gauge)
    }

    /// Moves by the next numbers of a step.
    pub(crate) fn step(&mut self, step: &mut impl Iterator<Item = f64>) {
        // A longer one would leave the basin.
        let free = self.free();
        for (value, most) in self.values.iter_mut().zip([0.03, 0.7, 0.3]).take(free) {
            *value += step.next().unwrap_or_default().clamp(-most, most);
        }
        let [lowest, highest] = RATIO.map(libm::log);
        self.values[1] = self.values[1].clamp(lowest, highest);
    }

    /// Number of its parameters.
    pub(crate) fn free(&self) -> usize {
        if self.place.on_gauges() { 3 } else { 2 }
    }
}

#[derive(Clone)]
pub(super) struct Fit {
    pub(super) platform: [f64; PLATFORM],
    pub(super) modes: Vec<Resonance>,
    pub(super) cost: f64,
}

/// What is fitted: P or T.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Domain {
    Open,
    Closed,
}

/// P of a fit at a frequency, with what its derivatives need.
pub(super) struct Evaluated {
    pub(super) factors: Factors,
    /// λ h of each leg, and h of each gauge.
    legs: [Complex; 6],
    gauges: [Complex; 6],
}

/// Every derivative of P or T is a sum of products of a column and a row of these.
pub(super) struct Factors {
    /// G (I + s D + s² W)⁻¹, and that times R and lags times A⁻¹: column i is the effect of leg i.
    left: Matrix6c,
    by_leg: Matrix6c,
    from_gauges: Matrix6c,
    /// (I + s D + s² W)⁻¹ R S, and B times that: row k is gauge k without its mount.
    right: Matrix6c,
    by_gauge: Matrix6c,
    to_legs: Matrix6c,
    /// P, or the effect of a common factor of P on T.
    pub(super) plant: Matrix6c,
}

impl Factors {
    /// From dP to dT = (I + P K)⁻¹ dP (I − K T).
    fn closed(&self, before: &Matrix6c, after: &Matrix6c) -> Self {
        Self {
            left: multiply(before, &self.left),
            by_leg: multiply(before, &self.by_leg),
            from_gauges: multiply(before, &self.from_gauges),
            right: multiply(&self.right, after),
            by_gauge: multiply(&self.by_gauge, after),
            to_legs: multiply(&self.to_legs, after),
            plant: multiply(&multiply(before, &self.plant), after),
        }
    }
}

pub(super) struct Problem {
    pub(super) points: Vec<Point>,
    /// ω of the modes of the platform, rad/s.
    frequencies: [f64; 6],
    pub(super) start: [f64; PLATFORM],
    period: f64,
    lag: f64,
    /// A, A⁻¹: modal coordinates to legs and back; B, B⁻¹: to gauges and back.
    legs: [Matrix6c; 2],
    gauges: [Matrix6c; 2],
}

impl Problem {
    pub(super) fn new(learnable: &Learnable, compiled: &Compilation, bins: &[Bin]) -> Option<Self> {
        let closed_loop = learnable.closed_loop();
        let basis = &closed_loop.basis;
        let per_reading = poses_per_reading(&compiled.model).ok()??;
        let to_legs = real(&multiply6(&leg_jacobian(&compiled.model.geometry)?, &basis.from_modal));
        let from_gauges = real(&multiply6(&basis.to_modal, &per_reading));
        let lowest = LOWEST * basis.frequencies[0] / TAU;
        let used: Vec<&Bin> = bins.iter().filter(|bin| bin.hertz >= lowest).collect();
        let hertz: Vec<f64> = used.iter().map(|bin| bin.hertz).collect();
        let (closed, open) = (learnable.nominal(&hertz), learnable.open_loop(&hertz));
        let mut start = [0.0; PLATFORM];
        for mode in 0..6 {
            start[7 * mode] = 1.0;
            start[DAMPING + mode] = closed_loop.damping[mode];
            start[GAINS + mode] = 1.0;
        }
        let mut problem = Self {
            points: Vec::new(),
            frequencies: basis.frequencies,
            start,
            period: closed_loop.period,
            lag: closed_loop.lag,
            legs: [to_legs, inverse(&to_legs)],
            gauges: [inverse(&from_gauges), from_gauges],
        };
        for ((bin, closed), open) in used.into_iter().zip(&closed).zip(&open) {
            let measured = inverse(&bin.response);
            let feedback = sum(&inverse(closed), &inverse(open), -1.0);
            let plant = inverse(&sum(&measured, &feedback, -1.0));
            let (before, after) = (multiply(&plant, &measured), multiply(&measured, &plant));
            let size = |of: &Matrix6c, i: usize, j: usize| {
                let row: f64 = (0..6).map(|k| square(of[i][k])).sum();
                let column: f64 = (0..6).map(|k| square(of[k][j])).sum();
                NONLINEAR * NONLINEAR * libm::sqrt(row * column)
            };
            let passed = |i: usize, j: usize| -> f64 {
                let part =
                    |k: usize, l: usize| square(before[i][k]) * square(after[l][j]) * bin.error[k][l] * bin.error[k][l];
                (0..6).map(|k| (0..6).map(|l| part(k, l)).sum::<f64>()).sum()
            };
            let weight = |variance: f64| libm::sqrt(2.0 / variance);
            let weights = each(|i, j| weight(bin.error[i][j] * bin.error[i][j] + size(&bin.response, i, j)));
            let plant_weights = each(|i, j| weight(passed(i, j) + size(&plant, i, j)));
            let rest = multiply(&problem.inner(bin.hertz, &problem.start), open);
            let known =
                [weights, plant_weights].iter().flatten().flatten().all(|weight| weight.is_finite() && *weight > 0.0);
            if known && plant.iter().flatten().flatten().all(|part| part.is_finite()) {
                let (hertz, closed) = (bin.hertz, bin.response);
                problem.points.push(Point { hertz, closed, weights, plant, plant_weights, feedback, rest });
            }
        }
        (problem.points.len() >= PLATFORM).then_some(problem)
    }

    /// I + s D + s² W.
    fn inner(&self, hertz: f64, platform: &[f64; PLATFORM]) -> Matrix6c {
        let angular = TAU * hertz;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let ratio = angular * angular / (self.frequencies[i] * self.frequencies[j]);
                let unit = f64::from(u8::from(i == j));
                [unit - ratio * platform[6 * i + j], unit * 2.0 * platform[DAMPING + i] * angular / self.frequencies[i]]
            })
        })
    }

    pub(super) fn evaluated(&self, point: &Point, fit: &Fit) -> Evaluated {
        let angular = TAU * point.hertz;
        let platform = &fit.platform;
        let product = |of: &dyn Fn(&Resonance) -> bool| {
            fit.modes.iter().filter(|mode| of(mode)).fold([1.0, 0.0], |all, mode| times(all, mode.factor(point.hertz)))
        };
        let legs: [Complex; 6] =
            std::array::from_fn(|leg| times([platform[GAINS + leg], 0.0], product(&|mode| mode.of_leg(leg))));
        let gauges: [Complex; 6] = std::array::from_fn(|gauge| product(&|mode| mode.of_gauge(gauge)));
        let late = angular * self.period * platform[DEAD_TIME];
        let lag = self.lag + self.period * platform[LAG];
        let slower = over([1.0, angular * self.lag], [1.0, angular * lag]);
        let late = times([libm::cos(late), -libm::sin(late)], slower);
        let solved = inverse(&self.inner(point.hertz, platform));
        let scaled = |factors: &[Complex; 6], matrix: &Matrix6c| -> Matrix6c {
            std::array::from_fn(|i| matrix[i].map(|value| times(factors[i], value)))
        };
        let series = multiply(&self.legs[1], &scaled(&legs, &self.legs[0]));
        let rest = point.rest.map(|row| row.map(|value| times(late, value)));
        let right = multiply(&multiply(&solved, &rest), &series);
        let by_gauge = multiply(&self.gauges[0], &right);
        let left = multiply(&multiply(&self.gauges[1], &scaled(&gauges, &self.gauges[0])), &solved);
        let by_leg = multiply(&multiply(&left, &rest), &self.legs[1]);
        let plant = multiply(&self.gauges[1], &scaled(&gauges, &by_gauge));
        let (from_gauges, to_legs) = (self.gauges[1], self.legs[0]);
        let factors = Factors { left, by_leg, from_gauges, right, by_gauge, to_legs, plant };
        Evaluated { factors, legs, gauges }
    }

    /// T of a fit, and the factors of dT on both sides of dP.
    fn closed(point: &Point, at: &Evaluated) -> [Matrix6c; 3] {
        let before = inverse(&left(&multiply(&at.factors.plant, &point.feedback), -1.0));
        let closed = multiply(&before, &at.factors.plant);
        let after = left(&multiply(&point.feedback, &closed), 1.0);
        [closed, before, after]
    }

    /// Effect of relative factors of the legs and of the gauges.
    pub(super) fn effect(at: &Evaluated, by: &Factors, legs: &[Complex; 6], gauges: &[Complex; 6]) -> Matrix6c {
        let mut effect = [[[0.0; 2]; 6]; 6];
        for k in 0..6 {
            if legs[k] != [0.0; 2] {
                let factor = times(legs[k], at.legs[k]);
                add_product(&mut effect, factor, &column(&by.by_leg, k), &by.to_legs[k]);
            }
            if gauges[k] != [0.0; 2] {
                let factor = times(gauges[k], at.gauges[k]);
                add_product(&mut effect, factor, &column(&by.from_gauges, k), &by.by_gauge[k]);
            }
        }
        effect
    }

    /// Derivatives of P or T by each parameter.
    fn derivatives(&self, point: &Point, fit: &Fit, at: &Evaluated, by: &Factors) -> Vec<Matrix6c> {
        let angular = TAU * point.hertz;
        let mut all = Vec::with_capacity(self.parameters(fit));
        let product = |factor: Complex, column: &[Complex; 6], row: &[Complex; 6]| {
            let mut effect = [[[0.0; 2]; 6]; 6];
            add_product(&mut effect, factor, column, row);
            effect
        };
        for i in 0..6 {
            for j in 0..6 {
                let ratio = angular * angular / (self.frequencies[i] * self.frequencies[j]);
                all.push(product([ratio, 0.0], &column(&by.left, i), &by.right[j]));
            }
        }
        for i in 0..6 {
            all.push(product([0.0, -2.0 * angular / self.frequencies[i]], &column(&by.left, i), &by.right[i]));
        }
        for leg in 0..6 {
            let factor = times(at.legs[leg], [1.0 / fit.platform[GAINS + leg], 0.0]);
            all.push(product(factor, &column(&by.by_leg, leg), &by.to_legs[leg]));
        }
        let step = angular * self.period;
        let lag = angular * (self.lag + self.period * fit.platform[LAG]);
        for factor in [[0.0, -step], over([0.0, -step], [1.0, lag])] {
            all.push(by.plant.map(|row| row.map(|value| times(factor, value))));
        }
        for mode in &fit.modes {
            for relative in mode.slopes(point.hertz) {
                let of = |acts: &dyn Fn(usize) -> bool| -> [Complex; 6] {
                    std::array::from_fn(|k| if acts(k) { relative } else { [0.0; 2] })
                };
                all.push(Self::effect(at, by, &of(&|leg| mode.of_leg(leg)), &of(&|gauge| mode.of_gauge(gauge))));
            }
        }
        all
    }

    pub(super) fn parameters(&self, fit: &Fit) -> usize {
        PLATFORM + fit.modes.iter().map(Resonance::free).sum::<usize>()
    }

    /// Deviation of each parameter of the platform from the spec over the expected one, and the latter.
    fn prior(&self, platform: &[f64; PLATFORM], k: usize) -> (f64, f64) {
        let expected = EXPECTED[[DAMPING, GAINS, DEAD_TIME, LAG].partition_point(|first| *first <= k)];
        ((platform[k] - self.start[k]) / expected, expected)
    }

    fn cost(&self, fit: &Fit, domain: Domain) -> f64 {
        let prior: f64 = (0..PLATFORM).map(|k| self.prior(&fit.platform, k).0).map(|off| off * off).sum();
        let off = |point: &Point| {
            let at = self.evaluated(point, fit);
            let off = match domain {
                Domain::Open => weighted(&point.plant_weights, &sum(&point.plant, &at.factors.plant, -1.0)),
                Domain::Closed => weighted(&point.weights, &sum(&point.closed, &Self::closed(point, &at)[0], -1.0)),
            };
            dot(&off, &off)
        };
        prior + self.points.iter().map(off).sum::<f64>()
    }

    /// JᵀJ and Jᵀ times what is missing.
    fn normal(&self, fit: &Fit, domain: Domain) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.parameters(fit);
        let mut gram = DMatrix::zeros(count, count);
        let mut slope = DVector::zeros(count);
        for k in 0..PLATFORM {
            let (off, expected) = self.prior(&fit.platform, k);
            gram[(k, k)] = 1.0 / (expected * expected);
            slope[k] = -off / expected;
        }
        for point in &self.points {
            let at = self.evaluated(point, fit);
            let (weights, missing, by) = match domain {
                Domain::Open => (&point.plant_weights, sum(&point.plant, &at.factors.plant, -1.0), None),
                Domain::Closed => {
                    let [closed, before, after] = Self::closed(point, &at);
                    let by = at.factors.closed(&before, &after);
                    (&point.weights, sum(&point.closed, &closed, -1.0), Some(by))
                }
            };
            let by = by.as_ref().unwrap_or(&at.factors);
            let missing = weighted(weights, &missing);
            let columns: Vec<[f64; 72]> =
                self.derivatives(point, fit, &at, by).iter().map(|derivative| weighted(weights, derivative)).collect();
            for (i, column) in columns.iter().enumerate() {
                slope[i] += dot(column, &missing);
                for (j, other) in columns.iter().enumerate().take(i + 1) {
                    gram[(i, j)] += dot(column, other);
                }
            }
        }
        gram.fill_upper_triangle_with_lower_triangle();
        (gram, slope)
    }

    /// Levenberg-Marquardt.
    pub(super) fn fitted(
        &self,
        platform: &[f64; PLATFORM],
        modes: Vec<Resonance>,
        steps: usize,
        domain: Domain,
    ) -> Fit {
        let mut fit = Fit { platform: *platform, modes, cost: 0.0 };
        fit.cost = self.cost(&fit, domain);
        let mut damping = 1e-3;
        let mut normal = self.normal(&fit, domain);
        for _ in 0..steps {
            let (gram, slope) = &normal;
            let mut damped = gram.clone();
            for k in 0..gram.nrows() {
                damped[(k, k)] *= 1.0 + damping;
            }
            let Some(factor) = Cholesky::new(damped) else { break };
            let mut tried = self.moved(&fit, &factor.solve(slope));
            tried.cost = self.cost(&tried, domain);
            if tried.cost < fit.cost {
                let small = fit.cost - tried.cost < 0.02 * self.misfit(&fit);
                fit = tried;
                damping *= 0.2;
                if small {
                    break;
                }
                normal = self.normal(&fit, domain);
            } else {
                damping *= 6.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        fit
    }

    fn moved(&self, fit: &Fit, step: &DVector<f64>) -> Fit {
        let mut moved = fit.clone();
        for (k, value) in moved.platform.iter_mut().enumerate() {
            *value += step[k];
        }
        let mut step = step.iter().copied().skip(PLATFORM);
        moved.modes.iter_mut().for_each(|mode| mode.step(&mut step));
        moved
    }

    /// χ² per degree of freedom, at least 1: a good fit does not narrow the errors.
    pub(super) fn misfit(&self, fit: &Fit) -> f64 {
        let free = (72 * self.points.len() - self.parameters(fit)) as f64;
        let misfit = fit.cost / free;
        if misfit > 1.0 { misfit } else { 1.0 }
    }

    pub(super) fn estimates(&self, fit: &Fit) -> Option<Vec<StructuralMode>> {
        let inverse = Cholesky::new(self.normal(fit, Domain::Closed).0)?.inverse();
        let scale = self.misfit(fit);
        let mut k = PLATFORM;
        let modes = fit.modes.iter().map(|mode| {
            let error = |which: usize| libm::sqrt(scale * inverse[(k + which, k + which)]);
            let relative = |which: usize| {
                let value = libm::exp(mode.values[which]);
                Parameter { value, error: value * error(which) }
            };
            let (frequency, damping) = (relative(0), relative(1));
            let participation = match mode.free() {
                3 => Parameter { value: mode.values[2], error: error(2) },
                _ => Parameter { value: 1.0, error: 0.0 },
            };
            k += mode.free();
            StructuralMode { frequency, damping, participation, place: mode.place }
        });
        Some(modes.collect())
    }
}

pub(crate) fn real(matrix: &Matrix6) -> Matrix6c {
    matrix.map(|row| row.map(|value| [value, 0.0]))
}

pub(crate) fn column(matrix: &Matrix6c, k: usize) -> [Complex; 6] {
    std::array::from_fn(|i| matrix[i][k])
}

fn each(value: impl Fn(usize, usize) -> f64) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| value(i, j)))
}
