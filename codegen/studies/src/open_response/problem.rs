//! The model of a response in open drive, its derivatives, and a start by linear least squares.

use std::f64::consts::{PI, TAU};

use nalgebra::{Cholesky, DMatrix, DVector};
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower::{leg_jacobian, poses_per_reading};
use specgen_language::model::StructuralKind;
use specgen_numerics::complex6::{Matrix6c, add_product, inverse, multiply, weighted};
use specgen_numerics::multiply6;
use specgen_numerics::nyquist::{Complex, over, square, times};

use crate::learning::structure::fit::{Resonance, column, real};
use crate::learning::{Bin, Learnable, Location};

/// Index of the first of each kind of parameter: W, ln D, Λ over the leg gain of the spec, lags and dead time in periods, φ, γ.
pub(super) const DAMPING: usize = 36;
pub(super) const GAINS: usize = 42;
pub(super) const LAGS: usize = 78;
pub(super) const DEAD_TIME: usize = 84;
pub(super) const LOSS: usize = 85;
pub(super) const CREEP: usize = 86;
/// Number of parameters of the platform.
pub(super) const PLATFORM: usize = 87;
/// Expected deviations of these from the spec: they keep what the records do not show near it.
const EXPECTED: [f64; 7] = [0.5, 2.0, 0.3, 5.0, 1.0, 0.2, 0.1];
/// That of an entry of Λ beside its diagonal.
const COUPLED: f64 = 0.05;
/// Lowest frequency used, over that of the lowest mode of the spec.
const LOWEST: f64 = 0.35;
/// Deviation of a machine from the linear model, relative to the response.
const NONLINEAR: f64 = 0.01;
/// Lags from which the start is chosen, over that of the spec.
const START_LAGS: [f64; 4] = [0.6, 0.85, 1.1, 1.4];
/// Highest frequency of the start, over that of the fastest mode of the spec.
const START_BAND: f64 = 1.2;
/// Least damping ratio of the start, and the largest.
const START_DAMPING: [f64; 2] = [0.01, 0.2];
/// Frequency at which creep is 1, Hz.
pub(super) const MIDDLE: f64 = 500.0;

/// A frequency.
pub(super) struct Point {
    pub hertz: f64,
    /// Modal coordinates (rows) per volt of a leg (columns).
    pub measured: Matrix6c,
    /// 1 over the standard deviation of each real number.
    pub weights: [[f64; 6]; 6],
}

/// Values of the parameters.
#[derive(Clone)]
pub(super) struct Fit {
    pub platform: Vec<f64>,
    pub modes: Vec<Resonance>,
    pub cost: f64,
}

pub(super) struct Problem {
    pub points: Vec<Point>,
    /// ω (rad/s) and ζ of the modes of the platform by the spec.
    pub frequencies: [f64; 6],
    pub damping: [f64; 6],
    pub period: f64,
    pub lag: f64,
    gauge_lag: f64,
    /// m/V.
    pub gain: f64,
    /// A, A⁻¹: modal coordinates to legs and back; to gauges and back.
    legs: [Matrix6c; 2],
    gauges: [Matrix6c; 2],
    /// Modes that the spec has.
    pub known: Vec<Resonance>,
}

/// The response of a fit at a frequency, with what its derivatives need.
pub(super) struct Evaluated {
    /// Column i: effect of modal force i, and of a displacement of leg i.
    left: Matrix6c,
    by_leg: Matrix6c,
    /// Row j: modal coordinate j.
    right: Matrix6c,
    by_gauge: Matrix6c,
    /// c of each leg.
    drive: [Complex; 6],
    pub response: Matrix6c,
}

impl Problem {
    /// None without a platform whose gauges determine its pose.
    pub fn new(compiled: &Compilation, bins: &[Bin]) -> Option<Self> {
        let learnable = Learnable::of(compiled)?;
        let closed_loop = learnable.closed_loop();
        let (model, basis) = (&compiled.model, &closed_loop.basis);
        let per_reading = poses_per_reading(model).ok()??;
        let to_legs = real(&multiply6(&leg_jacobian(&model.geometry)?, &basis.from_modal));
        let from_gauges = real(&multiply6(&basis.to_modal, &per_reading));
        let known = model.structural_modes.iter().map(|mode| Resonance {
            place: match (mode.kind, mode.place) {
                (StructuralKind::Leg, None) => Location::Legs,
                (StructuralKind::Leg, Some(leg)) => Location::Leg(leg),
                (StructuralKind::Gauge, Some(gauge)) => Location::Gauge(gauge),
                (StructuralKind::Gauge | StructuralKind::Frame, _) => Location::Gauges,
            },
            values: [libm::log(mode.frequency), libm::log(mode.damping_ratio), mode.participation],
        });
        let mut problem = Self {
            points: Vec::new(),
            frequencies: basis.frequencies,
            damping: closed_loop.damping,
            period: closed_loop.period,
            lag: closed_loop.lag,
            gauge_lag: closed_loop.gauge_lag,
            gain: model.actuator.leg_gain(),
            legs: [to_legs, inverse(&to_legs)],
            gauges: [inverse(&from_gauges), from_gauges],
            known: known.collect(),
        };
        let lowest = LOWEST * basis.frequencies[0] / TAU;
        problem.points = bins.iter().filter(|bin| bin.hertz >= lowest).map(|bin| problem.point(bin)).collect();
        Some(problem)
    }

    fn point(&self, bin: &Bin) -> Point {
        let measured = multiply(&self.gauges[1], &bin.response);
        let size = |i: usize, j: usize| {
            let row = (0..6).fold(0.0, |sum, k| sum + square(measured[i][k]));
            let column = (0..6).fold(0.0, |sum, k| sum + square(measured[k][j]));
            NONLINEAR * NONLINEAR * libm::sqrt(row * column)
        };
        let noise = |i: usize, j: usize| {
            (0..6).fold(0.0, |sum, k| sum + square(self.gauges[1][i][k]) * bin.error[k][j] * bin.error[k][j])
        };
        let weights = std::array::from_fn(|i| std::array::from_fn(|j| libm::sqrt(2.0 / (size(i, j) + noise(i, j)))));
        Point { hertz: bin.hertz, measured, weights }
    }

    /// I + s D + s² W.
    fn inner(&self, angular: f64, platform: &[f64]) -> Matrix6c {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let ratio = angular * angular / (self.frequencies[i] * self.frequencies[j]);
                let unit = f64::from(u8::from(i == j));
                [
                    unit - ratio * platform[6 * i + j],
                    unit * 2.0 * libm::exp(platform[DAMPING + i]) * angular / self.frequencies[i],
                ]
            })
        })
    }

    /// Of each leg: hold, dead time, lags, loss and creep.
    fn drive(&self, hertz: f64, platform: &[f64]) -> [Complex; 6] {
        let angular = TAU * hertz;
        let half = 0.5 * angular * self.period;
        let size = libm::sin(half) / half * libm::exp(-platform[CREEP] * libm::log(hertz / MIDDLE));
        let late = half + angular * self.period * platform[DEAD_TIME] + platform[LOSS] + 0.5 * PI * platform[CREEP];
        let common = over([size * libm::cos(late), -size * libm::sin(late)], [1.0, angular * self.gauge_lag]);
        std::array::from_fn(|leg| over(common, [1.0, angular * self.period * platform[LAGS + leg]]))
    }

    pub fn evaluated(&self, hertz: f64, fit: &Fit) -> Evaluated {
        let product = |of: &dyn Fn(&Resonance) -> bool| {
            fit.modes.iter().filter(|mode| of(mode)).fold([1.0, 0.0], |all, mode| times(all, mode.factor(hertz)))
        };
        let gauges: [Complex; 6] = std::array::from_fn(|gauge| product(&|mode| mode.of_gauge(gauge)));
        let mut drive = self.drive(hertz, &fit.platform);
        for (leg, drive) in drive.iter_mut().enumerate() {
            *drive = times(*drive, product(&|mode| mode.of_leg(leg)));
        }
        let solved = inverse(&self.inner(TAU * hertz, &fit.platform));
        let driven: Matrix6c = std::array::from_fn(|i| {
            std::array::from_fn(|j| drive[j].map(|part| self.gain * fit.platform[GAINS + 6 * i + j] * part))
        });
        let right = multiply(&multiply(&solved, &self.legs[1]), &driven);
        let by_gauge = multiply(&self.gauges[0], &right);
        let scaled =
            |matrix: &Matrix6c| -> Matrix6c { std::array::from_fn(|i| matrix[i].map(|value| times(gauges[i], value))) };
        let left = multiply(&multiply(&self.gauges[1], &scaled(&self.gauges[0])), &solved);
        let by_leg = multiply(&left, &self.legs[1]);
        let response = multiply(&self.gauges[1], &scaled(&by_gauge));
        Evaluated { left, by_leg, right, by_gauge: scaled(&by_gauge), drive, response }
    }

    /// Effect of relative factors of the legs and of the gauges on the response.
    pub fn effect(&self, at: &Evaluated, legs: &[Complex; 6], gauges: &[Complex; 6]) -> Matrix6c {
        let mut effect: Matrix6c = std::array::from_fn(|i| std::array::from_fn(|j| times(at.response[i][j], legs[j])));
        for k in (0..6).filter(|k| gauges[*k] != [0.0; 2]) {
            add_product(&mut effect, gauges[k], &column(&self.gauges[1], k), &at.by_gauge[k]);
        }
        effect
    }

    /// Derivatives of the response by each parameter, each number times its weight.
    pub fn derivatives(&self, point: &Point, fit: &Fit, at: &Evaluated) -> Vec<[f64; 72]> {
        let angular = TAU * point.hertz;
        let step = angular * self.period;
        let mut all = Vec::with_capacity(self.parameters(fit));
        let product = |factor: Complex, column: &[Complex; 6], row: &[Complex; 6]| {
            let mut effect = [[[0.0; 2]; 6]; 6];
            add_product(&mut effect, factor, column, row);
            weighted(&point.weights, &effect)
        };
        for (i, j) in (0..36).map(|k| (k / 6, k % 6)) {
            let ratio = angular * angular / (self.frequencies[i] * self.frequencies[j]);
            all.push(product([ratio, 0.0], &column(&at.left, i), &at.right[j]));
        }
        for i in 0..6 {
            let damped = -2.0 * libm::exp(fit.platform[DAMPING + i]) * angular / self.frequencies[i];
            all.push(product([0.0, damped], &column(&at.left, i), &at.right[i]));
        }
        for (i, j) in (0..36).map(|k| (k / 6, k % 6)) {
            let mut row = [[0.0; 2]; 6];
            row[j] = at.drive[j];
            all.push(product([self.gain, 0.0], &column(&at.by_leg, i), &row));
        }
        let relative = |of: &dyn Fn(usize) -> Complex| {
            weighted(&point.weights, &self.effect(at, &std::array::from_fn(of), &[[0.0; 2]; 6]))
        };
        for leg in 0..6 {
            let slower = over([0.0, -step], [1.0, step * fit.platform[LAGS + leg]]);
            all.push(relative(&|other| if other == leg { slower } else { [0.0; 2] }));
        }
        let creep = [-libm::log(point.hertz / MIDDLE), -0.5 * PI];
        for factor in [[0.0, -step], [0.0, -1.0], creep] {
            all.push(relative(&|_| factor));
        }
        for mode in &fit.modes {
            for relative in mode.slopes(point.hertz) {
                let of = |acts: &dyn Fn(usize) -> bool| -> [Complex; 6] {
                    std::array::from_fn(|k| if acts(k) { relative } else { [0.0; 2] })
                };
                let effect = self.effect(at, &of(&|leg| mode.of_leg(leg)), &of(&|gauge| mode.of_gauge(gauge)));
                all.push(weighted(&point.weights, &effect));
            }
        }
        all
    }

    pub fn parameters(&self, fit: &Fit) -> usize {
        PLATFORM + fit.modes.iter().map(Resonance::free).sum::<usize>()
    }

    /// Deviation of a parameter of the platform from the spec over the expected one, and the latter.
    pub fn prior(&self, platform: &[f64], k: usize) -> (f64, f64) {
        let kind = [DAMPING, GAINS, LAGS, DEAD_TIME, LOSS, CREEP].partition_point(|first| *first <= k);
        let is_diagonal = |k: usize| k.is_multiple_of(7);
        let (spec, expected) = match kind {
            0 => (f64::from(u8::from(is_diagonal(k))), EXPECTED[0]),
            1 => (libm::log(self.damping[k - DAMPING]), EXPECTED[1]),
            2 if is_diagonal(k - GAINS) => (1.0, EXPECTED[2]),
            2 => (0.0, COUPLED),
            3 => (self.lag / self.period, EXPECTED[3]),
            other => (0.0, EXPECTED[other]),
        };
        ((platform[k] - spec) / expected, expected)
    }

    /// The platform by linear least squares on (I + s D + s² W) H = A⁻¹ Λ diag(c), for several lags.
    pub fn starts(&self) -> impl Iterator<Item = Fit> + '_ {
        let shortest = if self.lag > self.period { self.lag } else { self.period };
        START_LAGS.into_iter().filter_map(move |factor| self.linear(factor * shortest))
    }

    /// The platform of the spec with this lag, s.
    fn spec(&self, lag: f64) -> Vec<f64> {
        let mut platform = vec![0.0; PLATFORM];
        for k in 0..6 {
            platform[7 * k] = 1.0;
            platform[DAMPING + k] = libm::log(self.damping[k]);
            platform[GAINS + 7 * k] = 1.0;
            platform[LAGS + k] = lag / self.period;
        }
        platform
    }

    fn linear(&self, lag: f64) -> Option<Fit> {
        let mut fit = Fit { platform: self.spec(lag), modes: self.known.clone(), cost: 0.0 };
        let mut driven = [[[0.0; 2]; 6]; 6];
        for row in 0..6 {
            let mut gram = DMatrix::<f64>::zeros(18, 18);
            let mut slope = DVector::<f64>::zeros(18);
            for point in self.points.iter().filter(|point| TAU * point.hertz < START_BAND * self.frequencies[5]) {
                let angular = TAU * point.hertz;
                let drive = self.drive(point.hertz, &fit.platform);
                let total = point.measured.iter().flatten().fold(0.0, |sum, value| sum + square(*value));
                let x = angular / self.frequencies[row];
                let weight = 1.0 / (libm::sqrt(total) * (1.0 + x * x));
                for leg in 0..6 {
                    // Unknown: W and D of this row, and A⁻¹ Λ of this row and leg.
                    let mut line = [[0.0; 2]; 18];
                    for (j, row_of) in point.measured.iter().enumerate() {
                        let y = angular / self.frequencies[j];
                        line[j] = row_of[leg].map(|part| weight * x * y * part);
                        line[6 + j] = times([0.0, -weight * y], row_of[leg]);
                    }
                    line[12 + leg] = drive[leg].map(|part| weight * self.gain * part);
                    let given = point.measured[row][leg].map(|part| weight * part);
                    for part in 0..2 {
                        for (i, one) in line.iter().enumerate().filter(|(_, one)| one[part] != 0.0) {
                            slope[i] += one[part] * given[part];
                            for (j, other) in line.iter().enumerate() {
                                gram[(i, j)] += one[part] * other[part];
                            }
                        }
                    }
                }
            }
            let solved = Cholesky::new(gram)?.solve(&slope);
            for j in 0..6 {
                fit.platform[6 * row + j] = solved[j];
                driven[row][j] = [solved[12 + j], 0.0];
            }
            let [least, most] = START_DAMPING;
            fit.platform[DAMPING + row] = libm::log((0.5 * solved[6 + row]).clamp(least, most));
        }
        let gains = multiply(&self.legs[0], &driven);
        for (k, [gain, _]) in gains.iter().flatten().enumerate() {
            fit.platform[GAINS + k] = *gain;
        }
        Some(fit)
    }
}
