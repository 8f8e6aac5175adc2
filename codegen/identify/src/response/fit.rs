//! Fits K · resonance · lag · dead time to bins of a response by Levenberg–Marquardt on ln H.

use nalgebra::{Cholesky, DMatrix, DVector};
use serde::Serialize;

use super::welch::Bin;
use crate::estimate::Parameter;

/// A second-order resonance with a first-order lag and a dead time, as fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResonanceFit {
    /// Static gain K, m/V.
    pub gain: Parameter,
    /// Undamped resonance ω0/2π, Hz.
    pub resonance: Parameter,
    /// Damping ratio ζ of the resonance.
    pub damping_ratio: Parameter,
    /// Time constant τ of the lag, s.
    pub lag: Parameter,
    /// Dead time T, s.
    pub dead_time: Parameter,
    /// τ + T, s: better determined than its parts, which look alike far below 1/τ.
    pub lag_and_dead_time: Parameter,
    /// Correlation of the errors of τ and T.
    pub lag_dead_time_correlation: f64,
}

/// ln K, ln f0, ln ζ, τ/s0, T/s0 with s0 = 1/(2π f0 of the start).
const N: usize = 5;
/// Upper limit of the coherence: leakage and jitter are not noise.
const CAP: f64 = 0.9995;
/// Fraction of independent averages among half-overlapped Hann segments.
const OVERLAPPED: f64 = 0.947;
const STEPS: usize = 200;

struct Problem<'a> {
    bins: &'a [Bin],
    weights: Vec<f64>,
    unit: f64,
}

impl Problem<'_> {
    fn residuals(&self, p: &[f64; N]) -> Vec<f64> {
        let mut out = Vec::with_capacity(2 * self.bins.len());
        for (bin, w) in self.bins.iter().zip(&self.weights) {
            let (log, phase) = model(p, self.unit, bin.frequency);
            let measured = libm::log(libm::hypot(bin.h[0], bin.h[1]));
            let turn = wrapped(libm::atan2(bin.h[1], bin.h[0]) - phase);
            out.push(w * (measured - log));
            out.push(w * turn);
        }
        out
    }

    fn jacobian(&self, p: &[f64; N], free: &[usize]) -> DMatrix<f64> {
        let mut j = DMatrix::zeros(2 * self.bins.len(), free.len());
        for (column, &k) in free.iter().enumerate() {
            let h = 1e-6;
            let (mut up, mut down) = (*p, *p);
            up[k] += h;
            down[k] -= h;
            let (a, b) = (self.residuals(&up), self.residuals(&down));
            for row in 0..a.len() {
                j[(row, column)] = (a[row] - b[row]) / (2.0 * h);
            }
        }
        j
    }
}

fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * libm::rint(angle / std::f64::consts::TAU)
}

/// ln |H| and arg H (rad) at `f` (Hz).
fn model(p: &[f64; N], unit: f64, f: f64) -> (f64, f64) {
    let (f0, zeta) = (libm::exp(p[1]), libm::exp(p[2]));
    let w = std::f64::consts::TAU * f;
    let x = f / f0;
    let (re, im) = (1.0 - x * x, 2.0 * zeta * x);
    let (lag, dead) = (w * p[3] * unit, w * p[4] * unit);
    let log = p[0] - 0.5 * libm::log(re * re + im * im) - 0.5 * libm::log(1.0 + lag * lag);
    (log, -libm::atan2(im, re) - libm::atan(lag) - dead)
}

/// Complex response of `fitted` at `f` (Hz): magnitude in m/V, phase in rad.
pub fn response(fitted: &ResonanceFit, f: f64) -> (f64, f64) {
    let p = [
        libm::log(fitted.gain.value),
        libm::log(fitted.resonance.value),
        libm::log(fitted.damping_ratio.value),
        fitted.lag.value,
        fitted.dead_time.value,
    ];
    let (log, phase) = model(&p, 1.0, f);
    (libm::exp(log), phase)
}

/// Fits to valid bins; the reason if there is no fit.
pub(super) fn fit(bins: &[Bin], averages: usize) -> Result<ResonanceFit, String> {
    let count = averages as f64 * OVERLAPPED;
    let weights: Vec<f64> = bins
        .iter()
        .map(|b| {
            let g = if b.coherence < CAP { b.coherence } else { CAP };
            (2.0 * count * g / (1.0 - g)).sqrt()
        })
        .collect();
    let size = |b: &Bin| libm::hypot(b.h[0], b.h[1]);
    let quarter = (bins.len() / 8).clamp(1, 8);
    let first = &bins[..quarter];
    let real = first.iter().fold(0.0, |sum, b| sum + b.h[0]);
    if real < 0.0 {
        return Err(format!(
            "at {:.3} to {:.3} Hz the displacement falls when the drive rises",
            first[0].frequency,
            first[quarter - 1].frequency
        ));
    }
    let gain = first.iter().fold(0.0, |sum, b| sum + size(b)) / quarter as f64;
    let peak = bins.iter().fold(&bins[0], |best, b| if size(b) > size(best) { b } else { best });
    let f0 = peak.frequency;
    let unit = 1.0 / (std::f64::consts::TAU * f0);
    let problem = Problem { bins, weights, unit };
    let mut best: Option<(f64, [f64; N])> = None;
    let zeta = (gain / (2.0 * size(peak))).clamp(0.003, 0.9);
    for (lag, dead) in [(0.1, 0.1), (1.0, 0.1), (3.0, 0.1), (0.1, 0.8)] {
        let start = [libm::log(gain), libm::log(f0), libm::log(zeta), lag, dead];
        let (cost, p) = minimise(&problem, start, &[0, 1, 2, 3, 4]);
        if cost.is_finite() && best.is_none_or(|(c, _)| cost < c) {
            best = Some((cost, p));
        }
    }
    let Some((_, mut p)) = best else {
        return Err("the fit of resonance, lag and dead time does not converge".to_owned());
    };
    // Neither lag nor dead time can be negative: a negative result is held at zero, the worse one first.
    let mut free = vec![0, 1, 2, 3, 4];
    for _ in 0..2 {
        let worst = if p[3] < p[4] { 3 } else { 4 };
        let Some(k) = [worst, 7 - worst].into_iter().find(|k| free.contains(k) && p[*k] < 0.0) else { break };
        free.retain(|f| *f != k);
        p[k] = 0.0;
        p = minimise(&problem, p, &free).1;
    }
    estimates(&problem, &p, &free)
}

fn minimise(problem: &Problem, start: [f64; N], free: &[usize]) -> (f64, [f64; N]) {
    let sum = |r: &[f64]| r.iter().fold(0.0, |s, v| s + v * v);
    let mut p = start;
    let mut r = problem.residuals(&p);
    let mut cost = sum(&r);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let j = problem.jacobian(&p, free);
        let (gram, slope) = normal(&j, &r);
        let mut damped = gram.clone();
        for k in 0..free.len() {
            damped[(k, k)] += damping * gram[(k, k)] + 1e-300;
        }
        let Some(factor) = Cholesky::new(damped) else { return (f64::INFINITY, p) };
        let step = factor.solve(&slope);
        let mut tried = p;
        for (column, &k) in free.iter().enumerate() {
            // At most a factor e: a longer step would leave the basin.
            tried[k] -= step[column].clamp(-1.0, 1.0);
        }
        let tried_r = problem.residuals(&tried);
        let tried_cost = sum(&tried_r);
        if tried_cost < cost {
            let small = cost - tried_cost < 1e-12 * cost;
            (p, r, cost) = (tried, tried_r, tried_cost);
            damping *= 0.3;
            if small {
                break;
            }
        } else {
            damping *= 5.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    (cost, p)
}

/// JᵀJ and Jᵀr with a written order of summation.
fn normal(j: &DMatrix<f64>, r: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let n = j.ncols();
    let dot = |a: usize, b: usize| (0..r.len()).fold(0.0, |sum, k| sum + j[(k, a)] * j[(k, b)]);
    let gram = DMatrix::from_fn(n, n, dot);
    let slope = DVector::from_fn(n, |a, _| (0..r.len()).fold(0.0, |sum, k| sum + j[(k, a)] * r[k]));
    (gram, slope)
}

fn estimates(problem: &Problem, p: &[f64; N], free: &[usize]) -> Result<ResonanceFit, String> {
    let r = problem.residuals(p);
    let j = problem.jacobian(p, free);
    let (gram, _) = normal(&j, &r);
    let Some(factor) = Cholesky::new(gram) else {
        return Err("the response does not determine resonance, damping and lag".to_owned());
    };
    let inverse = factor.inverse();
    let freedom = (r.len() - free.len()).max(1) as f64;
    let reduced = r.iter().fold(0.0, |s, v| s + v * v) / freedom;
    // A misfit of the model widens the errors; a good fit does not narrow them.
    let scale = if reduced > 1.0 { reduced } else { 1.0 };
    let covariance = |a: usize, b: usize| match (free.iter().position(|f| *f == a), free.iter().position(|f| *f == b)) {
        (Some(x), Some(y)) => scale * inverse[(x, y)],
        _ => 0.0,
    };
    let relative = |k: usize| {
        let value = libm::exp(p[k]);
        Parameter { value, error: value * covariance(k, k).sqrt() }
    };
    let unit = problem.unit;
    let time = |k: usize| Parameter { value: p[k] * unit, error: covariance(k, k).sqrt() * unit };
    let (lag, dead_time) = (time(3), time(4));
    let sum = covariance(3, 3) + covariance(4, 4) + 2.0 * covariance(3, 4);
    let product = lag.error * dead_time.error;
    Ok(ResonanceFit {
        gain: relative(0),
        resonance: relative(1),
        damping_ratio: relative(2),
        lag,
        dead_time,
        lag_and_dead_time: Parameter { value: lag.value + dead_time.value, error: sum.max(0.0).sqrt() * unit },
        lag_dead_time_correlation: if product > 0.0 { covariance(3, 4) * unit * unit / product } else { 0.0 },
    })
}

/// Weighted root mean square of |H1/H − 1|.
pub(super) fn misfit(fitted: &ResonanceFit, bins: &[Bin], averages: usize) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for b in bins {
        let g = if b.coherence < CAP { b.coherence } else { CAP };
        let w = averages as f64 * g / (1.0 - g);
        let (size, phase) = response(fitted, b.frequency);
        let ratio = libm::hypot(b.h[0], b.h[1]) / size;
        let turn = libm::atan2(b.h[1], b.h[0]) - phase;
        let (re, im) = (ratio * libm::cos(turn) - 1.0, ratio * libm::sin(turn));
        sum += w * (re * re + im * im);
        weight += w;
    }
    if weight > 0.0 { (sum / weight).sqrt() } else { 0.0 }
}
