//! Creep with one or several weights, dead time and a known mode after a table, all fitted at once (variable
//! projection).
//!
//! For given weights and dead time, the table is fitted to the rest after creep and mode. The error of the whole record
//! is then a function of these few numbers only, which Gauss-Newton steps minimise. The table is refitted for each
//! difference quotient, so that effects of the table do not count as creep.

use nalgebra::DMatrix;

use super::forward::{self, nonzero_terms};
use super::prepare::PreparedRecord;
use super::start::RecordColumns;
use super::table::Tables;
use super::{CreepTerm, Inertia, RateModel, creep};
use crate::least_squares::dot;
use crate::leg_model::TIMES;
use crate::mixed;
use crate::mode::Mode;
use specgen_numerics::nnls::Failure;

/// The model after the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Whether all time constants share one weight.
    pub(super) even: bool,
    /// A known mode.
    pub(super) mode: Option<Mode>,
}

const STEPS: usize = 12;
/// A step that lowers the error by less than this fraction is the last.
const WORTHWHILE: f64 = 1e-3;
/// Steps of the difference quotients: of a weight, and of the dead time (s).
const WEIGHT: f64 = 2e-3;
const LATER: f64 = 5e-6;
/// Weight at which the pull to zero equals an error of a ten thousandth of the range: parameters that the records do
/// not show stay small.
const PULL: f64 = 1e-4;
/// Passes in which table and start state converge.
const PASSES: usize = 2;

/// Weights and dead time of an attempt, their model, and its residual.
type Attempt = (Vec<f64>, RateModel, Vec<f64>);

struct Fit<'a> {
    tables: &'a Tables<'a>,
    own: Vec<RecordColumns>,
    times: Vec<f64>,
    shape: Shape,
}

/// Fits `shape` after a table, starting from the table and dead time of `start`.
pub(super) fn fit(tables: &Tables, start: &RateModel, shape: Shape) -> Result<RateModel, Failure> {
    let records = tables.records;
    let times = if shape.even { TIMES.to_vec() } else { creep::time_constants(records) };
    let own = records.iter().map(|p| p.own(&times, shape.mode)).collect();
    let fit = Fit { tables, own, times, shape };
    let weights = if shape.even { 1 } else { fit.times.len() };
    let mut at = vec![0.0; weights];
    at.push(start.dead_time);
    let mut model = fit.table(&at, start)?;
    let mut left = fit.left(&model);
    for _ in 0..STEPS {
        let step = fit.step(&at, &model, &left)?;
        let Some((next, found, rest)) = fit.along(&at, &step, &model, square(&left, &at))? else { break };
        let before = square(&left, &at);
        (at, model, left) = (next, found, rest);
        if square(&left, &at) > before * (1.0 - WORTHWHILE) {
            break;
        }
    }
    Ok(RateModel { creep: nonzero_terms(model.creep), ..model })
}

impl Fit<'_> {
    /// The model of weights and dead time `at`; `near` is a model close to it.
    fn table(&self, at: &[f64], near: &RateModel) -> Result<RateModel, Failure> {
        let (dead_time, weights) = at.split_last().map_or((0.0, at), |(last, weights)| (*last, weights));
        let weight = |k: usize| weights[if self.shape.even { 0 } else { k }];
        let terms = self.times.iter().enumerate().map(|(k, tau)| CreepTerm { time_constant: *tau, weight: weight(k) });
        let creep: Vec<CreepTerm> = terms.collect();
        let total = |creep: &[CreepTerm]| creep.iter().fold(1.0, |sum, term| sum + term.weight);
        let mut still = near.still.clone();
        let factor = total(&near.creep) / total(&creep);
        still.nodes.iter_mut().for_each(|node| *node *= factor);
        let mut model = RateModel { creep, ..RateModel::of_table(still, dead_time) };
        for pass in 0..PASSES {
            model.inertia = self.shape.mode.map(|mode| Inertia { mode, gain: model.still.reversal_gain() });
            let target = |(p, own): (&&PreparedRecord, &RecordColumns)| self.target(&model, p, own, pass > 0);
            let targets: Vec<Vec<f64>> = self.tables.records.iter().zip(&self.own).map(target).collect();
            model.still = self.tables.fit(&targets)?;
        }
        Ok(model)
    }

    /// Target of the table so that the complete model fits the record, m.
    fn target(&self, model: &RateModel, p: &PreparedRecord, own: &RecordColumns, started: bool) -> Vec<f64> {
        let time = &p.record.time[p.first..];
        let plain = forward::static_part(model, self.tables.plane, p);
        let mut moved = vec![0.0; time.len()];
        forward::inertia(model, time, &p.record.drive[p.first..], &mut moved);
        let whole = forward::with_creep(model, time, &plain);
        let mut target = p.delayed(model.dead_time);
        target.iter_mut().zip(moved).for_each(|(y, moved)| *y -= moved);
        if started {
            target.iter_mut().zip(&whole).for_each(|(y, f)| *y -= f);
            own.take_out_start(&mut target);
            target.iter_mut().zip(&whole).for_each(|(y, f)| *y += f);
        }
        forward::without_creep(model, time, &target)
    }

    /// Error of each sample as a fraction of its record's range and size.
    fn left(&self, model: &RateModel) -> Vec<f64> {
        let each = self.tables.records.iter().zip(&self.own).flat_map(|(p, own)| {
            let time = &p.record.time[p.first..];
            let mut y = forward::with_creep(model, time, &forward::static_part(model, self.tables.plane, p));
            forward::inertia(model, time, &p.record.drive[p.first..], &mut y);
            let mut left = p.delayed(model.dead_time);
            left.iter_mut().zip(y).for_each(|(left, y)| *left -= y);
            own.take_out(&mut left);
            let share = 1.0 / (p.record.displacement_range() * (p.samples() as f64).sqrt());
            let weightless = &p.record.weightless[p.first..];
            left.into_iter().zip(weightless).map(move |(x, w)| if *w { 0.0 } else { share * x }).collect::<Vec<_>>()
        });
        each.collect()
    }

    /// Minimum of the linearised error, weights ≥ 0.
    fn step(&self, at: &[f64], model: &RateModel, left: &[f64]) -> Result<Vec<f64>, Failure> {
        let unknowns = at.len();
        let mut columns = Vec::with_capacity(unknowns);
        for k in 0..unknowns {
            let width = if k + 1 < unknowns { WEIGHT } else { LATER };
            let mut beside = at.to_vec();
            beside[k] += width;
            let moved = self.left(&self.table(&beside, model)?);
            columns.push(moved.iter().zip(left).map(|(a, b)| (b - a) / width).collect::<Vec<f64>>());
        }
        // left − Σ column·(next − at): in terms of the next values, so that their bounds apply.
        let mut target = left.to_vec();
        for (column, value) in columns.iter().zip(at) {
            target.iter_mut().zip(column).for_each(|(y, x)| *y += value * x);
        }
        let unit: Vec<f64> = (0..unknowns).map(|k| if k + 1 < unknowns { 1.0 } else { 1e-3 }).collect();
        let mut gram =
            DMatrix::<f64>::from_fn(unknowns, unknowns, |a, b| unit[a] * unit[b] * dot(&columns[a], &columns[b]));
        for k in 0..unknowns {
            gram[(k, k)] += if k + 1 < unknowns { PULL * PULL } else { 1e-12 };
        }
        let rhs: Vec<f64> = (0..unknowns).map(|k| unit[k] * dot(&columns[k], &target)).collect();
        let next = mixed::solve(&gram, &rhs, unknowns - 1)?;
        Ok(next.iter().zip(&unit).map(|(x, unit)| x * unit).collect())
    }

    /// The first of the whole step, a half, a quarter … to `wanted` that lowers the error.
    fn along(&self, at: &[f64], wanted: &[f64], model: &RateModel, before: f64) -> Result<Option<Attempt>, Failure> {
        for share in [1.0, 0.5, 0.25] {
            let mut next: Vec<f64> = at.iter().zip(wanted).map(|(a, b)| a + share * (b - a)).collect();
            if let Some(dead_time) = next.last_mut() {
                *dead_time = if *dead_time > 0.0 { *dead_time } else { 0.0 };
            }
            let found = self.table(&next, model)?;
            let left = self.left(&found);
            if square(&left, &next) < before {
                return Ok(Some((next, found, left)));
            }
        }
        Ok(None)
    }
}

/// Sum of squares of errors, and of the weights that are pulled to zero.
fn square(left: &[f64], at: &[f64]) -> f64 {
    let weights = &at[..at.len() - 1];
    dot(left, left) + weights.iter().fold(0.0, |sum, w| sum + PULL * PULL * w * w)
}
