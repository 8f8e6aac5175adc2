//! Creep and dead time after a table: table and linear part are fitted in turn until neither changes much.
//!
//! With the table fixed, f and its creep states are known signals. The scale of f, the weights (≥ 0) and a change of
//! the dead time follow from a small least-squares problem, in which each record has its own offset and line: y(t + τ)
//! = s f + Σ w_j x_j − δτ ḟ. With those fixed, the table is fitted to y(t + τ) − Σ w_j x_j, with a free offset for each
//! branch. With one offset for a record, both steps would be the same least squares, and would find the weights of a
//! leg with linear creep. But the reference leg's creep has thresholds: on such a leg that method trades table for
//! creep without bound, and was far worse in the controller.

use nalgebra::DMatrix;

use super::forward::{nonzero_terms, parts};
use super::prepare::PreparedRecord;
use super::table::Tables;
use super::{CreepTerm, RateModel};
use crate::least_squares::dot;
use crate::mixed;
use crate::statistics::{Line, rates};
use specgen_numerics::nnls::Failure;

/// Fewest and most creep operators; between them, one a decade of the time constants.
const TERMS: [f64; 2] = [3.0, 6.0];
/// Shortest time constant, sampling intervals of the fastest record: faster creep is part of the dead time.
const SHORTEST: f64 = 20.0;
/// Longest time constant, as a fraction of the longest record: slower creep is a line.
const LONGEST: f64 = 1.0 / 3.0;
const TURNS: usize = 60;
/// An iteration that lowers the residual by less than this fraction is the last.
const WORTHWHILE: f64 = 2e-4;

/// Fits creep after the table and dead time of `start`.
pub(super) fn fit(tables: &Tables, start: &RateModel) -> Result<RateModel, Failure> {
    let (plane, records) = (tables.plane, tables.records);
    let times = time_constants(records);
    let mut model = start.clone();
    let mut before = f64::INFINITY;
    for _ in 0..TURNS {
        let signals: Vec<Vec<Vec<f64>>> = records.iter().map(|p| parts(&model, &times, plane, p)).collect();
        let linear = linear_part(records, &signals, model.dead_time)?;
        if before.is_finite() && linear.residual > before * (1.0 - WORTHWHILE) {
            break;
        }
        before = linear.residual;
        model.dead_time = if model.dead_time + linear.later > 0.0 { model.dead_time + linear.later } else { 0.0 };
        let targets: Vec<Vec<f64>> = records
            .iter()
            .zip(&signals)
            .map(|(p, signals)| {
                let mut target = p.delayed(model.dead_time);
                for (weight, x) in linear.weights.iter().zip(&signals[1..]) {
                    target.iter_mut().zip(x).for_each(|(y, x)| *y -= weight * x);
                }
                target
            })
            .collect();
        model.still = tables.fit(&targets)?;
        let terms = times.iter().zip(&linear.weights);
        model.creep =
            nonzero_terms(terms.map(|(tau, w)| CreepTerm { time_constant: *tau, weight: w / linear.scale }).collect());
    }
    Ok(model)
}

/// Evenly spaced in their logarithm, slowest first, s.
pub(super) fn time_constants(records: &[&PreparedRecord]) -> Vec<f64> {
    let longest = records.iter().map(|p| p.duration()).fold(0.0, |a, b| if b > a { b } else { a }) * LONGEST;
    let shortest = records.iter().map(|p| p.interval).fold(longest, |a, b| if b < a { b } else { a }) * SHORTEST;
    let shortest = if shortest < longest { shortest } else { 0.1 * longest };
    let wanted = libm::ceil(libm::log10(longest / shortest)) + 1.0;
    let terms = crate::staircase::saturate(wanted, TERMS) as usize;
    let ratio = libm::log(shortest / longest) / (terms - 1) as f64;
    (0..terms).map(|k| rounded(longest * libm::exp(ratio * k as f64))).collect()
}

/// To three digits: a time constant is chosen, not measured.
fn rounded(seconds: f64) -> f64 {
    let digit = libm::pow(10.0, libm::floor(libm::log10(seconds)) - 2.0);
    (seconds / digit).round() * digit
}

struct Linear {
    /// s: the scale of f.
    scale: f64,
    /// w_j.
    weights: Vec<f64>,
    /// δτ, s.
    later: f64,
    /// Mean square residual over all records, m².
    residual: f64,
}

/// `signals`: f and the creep states of each record.
fn linear_part(records: &[&PreparedRecord], signals: &[Vec<Vec<f64>>], dead_time: f64) -> Result<Linear, Failure> {
    // Unknowns: w_j ≥ 0, then s and −δτ.
    let terms = signals.first().map_or(0, |signals| signals.len() - 1);
    let unknowns = terms + 2;
    let mut gram = DMatrix::zeros(unknowns, unknowns);
    let mut rhs = vec![0.0; unknowns];
    let mut energy = 0.0;
    let mut scale_of = vec![0.0; unknowns];
    for (pass, (p, signals)) in records.iter().zip(signals).chain(records.iter().zip(signals)).enumerate() {
        let time = &p.record.time[p.first..];
        let mut columns: Vec<Vec<f64>> = signals[1..].to_vec();
        columns.push(signals[0].clone());
        columns.push(rates(time, &signals[0], &vec![true; time.len()]));
        columns.iter_mut().for_each(|column| *column = Line::fit(time, column).removed(time, column));
        let share = 1.0 / p.samples() as f64;
        if pass < records.len() {
            // First pass: the size of each column, to scale the small matrix.
            for (scale, column) in scale_of.iter_mut().zip(&columns) {
                *scale += share * dot(column, column);
            }
            continue;
        }
        let y = p.delayed(dead_time);
        let y = Line::fit(time, &y).removed(time, &y);
        energy += share * dot(&y, &y);
        for (a, column) in columns.iter().enumerate() {
            let size = share / scale_of[a].sqrt();
            rhs[a] += size * dot(column, &y);
            for (b, other) in columns.iter().enumerate() {
                gram[(a, b)] += size * dot(column, other) / scale_of[b].sqrt();
            }
        }
    }
    for k in 0..unknowns {
        gram[(k, k)] += 1e-10;
    }
    let target_size = energy.sqrt();
    let scaled: Vec<f64> = rhs.iter().map(|b| b / target_size).collect();
    let solution = mixed::solve(&gram, &scaled, terms)?;
    let explained = dot(&solution, &scaled);
    let value = |k: usize| solution[k] * target_size / scale_of[k].sqrt();
    Ok(Linear {
        scale: value(terms),
        weights: (0..terms).map(value).collect(),
        later: -value(terms + 1),
        residual: energy * (1.0 - explained),
    })
}
