//! Levenberg–Marquardt, the search for modes that the platform does not have, and what a fit says.

use std::f64::consts::{PI, TAU};

use nalgebra::{Cholesky, DMatrix, DVector};
use specgen_identify::Parameter;
use specgen_numerics::complex6::{Matrix6c, dot, sum, weighted};
use specgen_numerics::nyquist::{plus, square, times};
use specgen_numerics::{Matrix, eigenvalues};

use super::problem::{CREEP, DAMPING, DEAD_TIME, Fit, GAINS, LAGS, LOSS, MIDDLE, PLATFORM, Point, Problem};
use super::{FoundMode, OpenResponse, OtherMode};
use crate::learning::structure::fit::Resonance;
use crate::learning::structure::{Direction, LEAST_PART, MAX_MODES, MIN_CHI2_DROP, candidates};
use crate::learning::{Location, StructuralMode};

/// Steps of a fit, and of those from which the best is chosen.
const STEPS: [usize; 2] = [40, 6];
/// Relative fall of the cost that ends a fit.
const ENDED: f64 = 1e-5;
/// Relative uncertainty of damping ratios beside the noise, and that per rad of doubt: from machines in simulation.
const RATIO_DOUBT: [f64; 2] = [0.002, 0.2];
/// Relative step of derivatives of the modes.
const STEP: f64 = 1e-5;

/// Numbers of the dynamics: frequency and ζ of six modes; index of stiffness over mass and of damping.
const DYNAMICS: usize = 14;
const STIFFNESS: usize = 12;
const DAMPED: usize = 13;

/// Frequencies (Hz) and ζ of six modes.
type Modes = [[f64; 2]; 6];

impl Problem {
    /// The fit from the best start, with every mode that the records show.
    ///
    /// # Errors
    /// There are too few frequencies.
    pub(super) fn searched(&self) -> Result<Fit, String> {
        if 72 * self.points.len() <= 4 * PLATFORM {
            return Err(format!("the records show only {} frequencies", self.points.len()));
        }
        let starts = self.starts().map(|start| self.fitted(start, STEPS[1]));
        let start = starts.min_by(|a, b| a.cost.total_cmp(&b.cost)).ok_or("the records do not determine the modes")?;
        let mut fit = self.fitted(start, STEPS[0]);
        while fit.modes.len() < MAX_MODES {
            let next = |mode: Resonance| {
                let modes = fit.modes.iter().copied().chain([mode]).collect();
                self.fitted(Fit { modes, ..fit.clone() }, STEPS[1])
            };
            let sought = candidates(self.directions(&fit)).into_iter().map(next);
            let Some(best) = sought.min_by(|a, b| a.cost.total_cmp(&b.cost)) else { break };
            if fit.cost - best.cost < MIN_CHI2_DROP * self.misfit(&best) {
                break;
            }
            let best = self.fitted(best, STEPS[0]);
            let Some(found) = self.covariance(&best).and_then(|covariance| {
                self.structural(&best, &covariance).pop().filter(|mode| mode.participation.value.abs() >= LEAST_PART)
            }) else {
                break;
            };
            if !found.is_certain() {
                break;
            }
            fit = best;
        }
        Ok(fit)
    }

    /// For each direction (legs, gauges, all), what the fit leaves there at each frequency, relative, with its weight.
    fn directions(&self, fit: &Fit) -> Vec<(Location, Direction)> {
        let places = (0..6).map(Location::Leg).chain((0..6).map(Location::Gauge)).chain([Location::Legs]);
        let mut all: Vec<_> = places.map(|place| (place, Vec::with_capacity(self.points.len()))).collect();
        for point in &self.points {
            let at = self.evaluated(point.hertz, fit);
            let missing = weighted(&point.weights, &sum(&point.measured, &at.response, -1.0));
            for (place, list) in &mut all {
                let one = |own: bool| [f64::from(u8::from(own)), 0.0];
                let legs = std::array::from_fn(|leg| one(*place == Location::Legs || *place == Location::Leg(leg)));
                let gauges = std::array::from_fn(|gauge| one(*place == Location::Gauge(gauge)));
                let effect = weighted(&point.weights, &self.effect(&at, &legs, &gauges));
                let numbers = |of: &[f64; 72], k: usize| [of[2 * k], of[2 * k + 1]];
                let product = (0..36).fold([0.0; 2], |sum, k| {
                    let [re, im] = numbers(&effect, k);
                    plus(sum, times([re, -im], numbers(&missing, k)))
                });
                let weight = dot(&effect, &effect);
                list.push((point.hertz, product.map(|part| part / weight), weight));
            }
        }
        all
    }

    fn missing(&self, point: &Point, fit: &Fit) -> [f64; 72] {
        weighted(&point.weights, &sum(&point.measured, &self.evaluated(point.hertz, fit).response, -1.0))
    }

    fn cost(&self, fit: &Fit) -> f64 {
        let prior = (0..PLATFORM).map(|k| self.prior(&fit.platform, k).0).fold(0.0, |sum, off| sum + off * off);
        self.points.iter().map(|point| self.missing(point, fit)).fold(prior, |sum, off| sum + dot(&off, &off))
    }

    /// χ² per degree of freedom.
    fn misfit(&self, fit: &Fit) -> f64 {
        fit.cost / (72 * self.points.len() - self.parameters(fit)) as f64
    }

    /// JᵀJ and Jᵀ times what is missing.
    fn normal(&self, fit: &Fit) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.parameters(fit);
        let mut gram = DMatrix::zeros(count, count);
        let mut slope = DVector::zeros(count);
        for k in 0..PLATFORM {
            let (off, expected) = self.prior(&fit.platform, k);
            gram[(k, k)] = 1.0 / (expected * expected);
            slope[k] = -off / expected;
        }
        for point in &self.points {
            let at = self.evaluated(point.hertz, fit);
            let missing = weighted(&point.weights, &sum(&point.measured, &at.response, -1.0));
            let columns = self.derivatives(point, fit, &at);
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

    /// Levenberg–Marquardt.
    fn fitted(&self, mut fit: Fit, steps: usize) -> Fit {
        fit.cost = self.cost(&fit);
        let mut damping = 1e-3;
        let mut normal = self.normal(&fit);
        for _ in 0..steps {
            let (gram, slope) = &normal;
            let mut damped = gram.clone();
            (0..gram.nrows()).for_each(|k| damped[(k, k)] *= 1.0 + damping);
            let Some(factor) = Cholesky::new(damped) else { break };
            let step = factor.solve(slope);
            let mut tried = fit.clone();
            tried.platform.iter_mut().zip(step.iter()).for_each(|(value, step)| *value += step);
            let mut rest = step.iter().copied().skip(PLATFORM);
            tried.modes.iter_mut().for_each(|mode| mode.step(&mut rest));
            tried.cost = self.cost(&tried);
            if tried.cost < fit.cost {
                let ended = fit.cost - tried.cost < ENDED * fit.cost;
                fit = tried;
                damping *= 0.2;
                if ended {
                    break;
                }
                normal = self.normal(&fit);
            } else {
                damping *= 6.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        fit
    }

    /// Covariance of the parameters.
    fn covariance(&self, fit: &Fit) -> Option<DMatrix<f64>> {
        Some(Cholesky::new(self.normal(fit).0)?.inverse() * self.misfit(fit))
    }

    /// The structural modes of a fit.
    fn structural(&self, fit: &Fit, covariance: &DMatrix<f64>) -> Vec<StructuralMode> {
        let mut first = PLATFORM;
        let all = fit.modes.iter().map(|mode| {
            let error = |which: usize| libm::sqrt(covariance[(first + which, first + which)]);
            let relative = |which: usize| {
                let value = libm::exp(mode.values[which]);
                Parameter { value, error: value * error(which) }
            };
            let participation = match mode.free() {
                3 => Parameter { value: mode.values[2], error: error(2) },
                _ => Parameter { value: 1.0, error: 0.0 },
            };
            let found =
                StructuralMode { frequency: relative(0), damping: relative(1), participation, place: mode.place };
            first += mode.free();
            found
        });
        all.collect()
    }

    /// Frequencies and damping ratios of I + s D + s² W = 0, in ascending order.
    fn modes(&self, platform: &[f64]) -> Option<Modes> {
        let unit = self.frequencies[0];
        let ratio = self.frequencies.map(|frequency| unit / frequency);
        let mass = nalgebra::Matrix6::from_fn(|i, j| platform[6 * i + j] * ratio[i] * ratio[j]).try_inverse()?;
        let mut states = Matrix::zeros(12);
        for i in 0..6 {
            let mut row = [0.0; 12];
            row[6 + i] = 1.0;
            states.set_row(i, &row);
            for j in 0..6 {
                row[j] = -mass[(i, j)];
                row[6 + j] = -mass[(i, j)] * 2.0 * libm::exp(platform[DAMPING + j]) * ratio[j];
            }
            states.set_row(6 + i, &row);
        }
        let mut found: Vec<[f64; 2]> = eigenvalues(&states)?
            .into_iter()
            .filter(|(_, imaginary)| *imaginary > 0.0)
            .map(|(real, imaginary)| {
                let size = libm::hypot(real, imaginary);
                [size * unit / TAU, -real / size]
            })
            .collect();
        found.sort_by(|a, b| a[0].total_cmp(&b[0]));
        found.try_into().ok()
    }

    /// Phase that loss and creep of small loops may be off by, rad: half of what they are, as a linear model of them is rough.
    fn doubt(&self, fit: &Fit) -> f64 {
        0.5 * fit.platform[LOSS].abs() + 0.25 * PI * fit.platform[CREEP].abs()
    }

    /// Frequency (Hz) and ζ of each mode, and ln of stiffness over mass and of damping over those of the spec, with standard errors.
    fn dynamics(&self, fit: &Fit, covariance: &DMatrix<f64>) -> Option<[[f64; DYNAMICS]; 2]> {
        let values = |platform: &[f64]| -> Option<[f64; DYNAMICS]> {
            let modes = self.modes(platform)?;
            let mean = |of: &dyn Fn(usize) -> f64| (0..6).fold(0.0, |sum, k| sum + of(k)) / 6.0;
            let mut all = [0.0; DYNAMICS];
            all[STIFFNESS] = mean(&|k| 2.0 * libm::log(TAU * modes[k][0] / self.frequencies[k]));
            all[DAMPED] = mean(&|k| libm::log(modes[k][1] / self.damping[k]));
            all.iter_mut().zip(modes.iter().flatten()).for_each(|(value, of)| *value = *of);
            Some(all)
        };
        let mut slopes = vec![[0.0; DYNAMICS]; GAINS];
        for (k, slope) in slopes.iter_mut().enumerate() {
            let mut moved = fit.platform.clone();
            moved[k] += STEP;
            let above = values(&moved)?;
            moved[k] -= 2.0 * STEP;
            let below = values(&moved)?;
            *slope = std::array::from_fn(|of| (above[of] - below[of]) / (2.0 * STEP));
        }
        let error = |of: usize| {
            let both = (0..GAINS * GAINS).map(|k| (k / GAINS, k % GAINS));
            libm::sqrt(both.fold(0.0, |sum, (i, j)| sum + slopes[i][of] * covariance[(i, j)] * slopes[j][of]))
        };
        Some([values(&fit.platform)?, std::array::from_fn(error)])
    }

    /// What a fit says; none if it is not certain of anything.
    pub(super) fn response(&self, fit: &Fit) -> Option<OpenResponse> {
        let covariance = self.covariance(fit)?;
        let [values, errors] = self.dynamics(fit, &covariance)?;
        let doubt = self.doubt(fit);
        let wider = |value: f64, error: f64, share: f64| Parameter { value, error: libm::hypot(error, value * share) };
        // A phase that is off by ε moves a resonance by ε ζ of its frequency; about half of that is seen.
        let shift = |mode: usize| 0.5 * doubt * values[2 * mode + 1];
        let damped = RATIO_DOUBT[0] + RATIO_DOUBT[1] * doubt;
        let mode = |k: usize| FoundMode {
            frequency: wider(values[2 * k], errors[2 * k], shift(k)),
            zeta: wider(values[2 * k + 1], errors[2 * k + 1], damped),
            spec: [self.frequencies[k] / TAU, self.damping[k]],
        };
        let ratio = |of: usize, share: f64| {
            let value = libm::exp(values[of]);
            wider(value, value * errors[of], share)
        };
        // Of a sum of parameters, each times a share.
        let time = |parts: &[(usize, f64)]| {
            let value = parts.iter().fold(0.0, |sum, (k, share)| sum + share * fit.platform[*k]);
            let pairs = parts.iter().flat_map(|one| parts.iter().map(move |other| (one, other)));
            let variance = pairs.fold(0.0, |sum, ((i, a), (j, b))| sum + a * b * covariance[(*i, *j)]);
            let error = libm::hypot(self.period * libm::sqrt(variance), doubt / (TAU * MIDDLE));
            Parameter { value: self.period * value, error }
        };
        let mut parts: Vec<(usize, f64)> = (LAGS..DEAD_TIME).map(|k| (k, 1.0 / 6.0)).collect();
        let lag = time(&parts);
        parts.push((DEAD_TIME, 1.0));
        Some(OpenResponse {
            modes: (0..6).map(mode).collect(),
            others: self.others(fit, &covariance),
            lags: std::array::from_fn(|leg| self.period * fit.platform[LAGS + leg]),
            lag,
            dead_time: time(&parts[6..]),
            delay: time(&parts),
            gains: std::array::from_fn(|leg| self.gain * fit.platform[GAINS + 7 * leg]),
            stiffness_to_mass: ratio(STIFFNESS, 2.0 * shift(0)),
            damping: ratio(DAMPED, damped),
            misfit: self.left(fit),
            band: [self.points.first()?.hertz, self.points.last()?.hertz],
        })
    }

    fn others(&self, fit: &Fit, covariance: &DMatrix<f64>) -> Vec<OtherMode> {
        let known = self.known.len();
        let other = |(index, mode): (usize, StructuralMode)| OtherMode {
            place: mode.at(),
            frequency: mode.frequency,
            zeta: mode.damping,
            participation: mode.participation,
            known: index < known,
        };
        let mut all: Vec<OtherMode> = self.structural(fit, covariance).into_iter().enumerate().map(other).collect();
        all.sort_by(|a, b| a.frequency.value.total_cmp(&b.frequency.value));
        all
    }

    /// Root mean square of what a fit leaves, over the size of the response.
    fn left(&self, fit: &Fit) -> f64 {
        let size = |of: &Matrix6c| of.iter().flatten().fold(0.0, |sum, value| sum + square(*value));
        let [left, whole] = self.points.iter().fold([0.0; 2], |[left, whole], point| {
            let off = sum(&point.measured, &self.evaluated(point.hertz, fit).response, -1.0);
            [left + size(&off), whole + size(&point.measured)]
        });
        libm::sqrt(left / whole)
    }
}
