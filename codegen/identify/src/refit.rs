//! Refit of a leg of a platform from an ordinary recorded run: its gain, delay and cubic term relative to its model.
//!
//! ```text
//! y(t + τ) = λ p + c H T₃(s) + nuisance          s = 2 p/H − 1
//! nuisance   1, t, e^(−10 t/D); T₂(s) if c is fitted; what no other column explains of the voltage
//! ```
//! p is the displacement of the model for the recorded voltages, H its stroke, D the duration of the run. The model
//! takes the unknown state before the run from the run. λ is the gain of the fundamental over the full stroke, because
//! T₃ has none; c is the shift of both ends, outwards, as a share of the stroke. The voltage widens or narrows the loop
//! at every rate alike, so that only what grows with the rate counts as delay. Forces on the platform are not
//! subtracted: a slow run, well below the lowest mode, has almost none.
//!
//! A run over a small part of the stroke cannot tell λ from c: T₃ is almost a line there. Then c keeps its old value, and
//! λ is the mean gain over the motion of the run. What a usual c would add to it is stated.
//!
//! Standard errors are from fits without each of several blocks of the run (jackknife), not from its samples: residuals
//! of a wrong model last. That of c is at least what a third of the residual would be as a cubic term. A number whose
//! standard error exceeds a third of its spread keeps its old value, and the others are fitted without it.

use nalgebra::{Cholesky, DMatrix, DVector};
use serde::Serialize;

use super::least_squares::{dot, fit, mean_square};
use super::rate::RateModel;
use super::rate::predict::{Drive, Prediction, predict};
use super::record::later;
use super::statistics::{extent, rates};
use crate::everett::EverettTable;
use crate::leg_model::{Around, LegModel, third};
use specgen_language::diagnostic::{Diagnostic, codes};

/// Usual spread of gain (relative), delay (s) and cubic term (share of the stroke) from one session to another. The first
/// two are assumed. A cubic term took the error of a real actuator in five other sessions from 0.34 to 0.19 % of its range:
/// 0.28 % rms, and T₃ has 0.7.
pub const SPREAD: [f64; 3] = [0.05, 1e-4, 0.004];
/// Largest standard error of an accepted number, as a share of its spread.
pub const KNOWN: f64 = 1.0 / 3.0;
/// A leg no longer matches if a number differs by more than this, and by three standard errors. The delays of six legs
/// differ by almost as much from the one lead of a spec.
const WORTHWHILE: [f64; 3] = [0.01, 1e-4, 0.001];
/// Share of the residual that may be an error of the model like a cubic term, in all blocks alike: a third was seen.
const LIKENESS: f64 = 1.0 / 3.0;
/// Numbers of blocks; the larger of the standard errors counts.
const BLOCKS: [usize; 2] = [8, 32];
/// A run needs at least this many samples.
const LEAST: usize = 16 * 32;
/// Least travel, rms residuals: with less, feedback of the noise would be mistaken for motion of the leg.
const TRAVEL: f64 = 20.0;
/// Passes over the unknown state before the run: it is found from the run, of which gain and cubic term are found.
const PASSES: usize = 5;
/// Steps of the search for the delay, and the change (s) after which it ends.
const STEPS: usize = 20;
const SETTLED: f64 = 1e-8;

/// A run of one leg.
#[derive(Debug, Clone, Copy)]
pub struct LegRun<'a> {
    /// Name in findings.
    pub shown_as: &'a str,
    /// s, rising.
    pub time: &'a [f64],
    /// V.
    pub voltage: &'a [f64],
    /// m.
    pub displacement: &'a [f64],
    /// Expected delay of the displacement behind the voltage, s.
    pub delay: f64,
}

/// A number of a leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Number {
    /// Change since identification; 0 if it is refused.
    pub change: f64,
    /// Standard error; infinite if the run does not show the number at all.
    pub error: f64,
    /// Whether it is known well enough.
    pub accepted: bool,
}

/// Of a run that does not show the number at all.
const UNKNOWN: Number = Number { change: 0.0, error: f64::INFINITY, accepted: false };

/// One leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LegRefit {
    /// λ − 1: over the full stroke with a cubic term, else over the motion of the run.
    pub gain: Number,
    /// s.
    pub delay: Number,
    /// c, share of the stroke.
    pub cubic: Number,
    /// Mean gain over the motion of the run that a cubic term of 1 amounts to.
    pub gain_per_cubic: f64,
    /// Difference of the highest and lowest displacement, m.
    pub travel: f64,
    /// Of the model, m.
    pub stroke: f64,
    /// Root mean square residual, m.
    pub residual_rms: f64,
    /// With the old numbers; only an offset and a drift are removed, m.
    pub residual_before: f64,
}

impl LegRefit {
    /// Gain, delay, cubic term.
    #[must_use]
    pub fn numbers(&self) -> [Number; 3] {
        [self.gain, self.delay, self.cubic]
    }

    /// Travel that shows the gain, m: a quarter of the stroke.
    #[must_use]
    pub fn enough(&self) -> f64 {
        0.25 * self.stroke
    }

    /// Changes of gain and cubic term for the leg's table: a cubic term that does not differ is counted as gain.
    #[must_use]
    pub fn changes(&self) -> [f64; 2] {
        let (gain, cubic) = (self.gain.change, self.cubic.change);
        if self.differs()[2] { [gain, cubic] } else { [gain + self.gain_per_cubic * cubic, 0.0] }
    }

    /// Which numbers no longer match the model.
    #[must_use]
    pub fn differs(&self) -> [bool; 3] {
        let numbers = self.numbers();
        core::array::from_fn(|k| {
            let Number { change, error, accepted } = numbers[k];
            accepted && change.abs() > 3.0 * error && change.abs() > WORTHWHILE[k]
        })
    }
}

/// Refits a leg with `model`, whose dead time and mode are not used. None if it never moves, or the run is too short.
///
/// # Errors
/// As [`predict`]: the voltage leaves the range of the table.
pub fn of(model: &RateModel, run: &LegRun) -> Result<Option<LegRefit>, Vec<Diagnostic>> {
    let model = RateModel { dead_time: 0.0, inertia: None, ..model.clone() };
    let mut drive = Drive::of_voltage(run.shown_as, run.time.to_vec(), run.voltage.to_vec());
    let first = match predict(&model, &drive) {
        Ok(first) => first,
        Err(found) if found.iter().all(|one| one.code == codes::VALIDATION_IDLE) => return Ok(None),
        Err(found) => return Err(found),
    };
    let mut latest = first;
    for _ in 0..PASSES {
        let Some((solution, _)) = Signals::of(&model, run, &latest).and_then(|signals| signals.known()) else {
            return Ok(None);
        };
        // The displacement as the model would have it shows the state before the run.
        let mut displacement = vec![latest.displacement[0]; latest.samples_skipped];
        let gain = 1.0 + solution.changes[0];
        displacement.extend(latest.displacement.iter().zip(&solution.residual).map(|(p, r)| p + r / gain));
        drive.displacement = Some(displacement);
        latest = predict(&model, &drive)?;
    }
    Ok(Signals::of(&model, run, &latest).and_then(|signals| signals.refit()))
}

/// The leg of `model` with a gain of 1 + `gain` and the cubic term `cubic`. `shaped`: with a read-out around its table
/// in any case, as other legs have one.
///
/// # Errors
/// A controller cannot run it.
pub fn refitted(model: &RateModel, gain: f64, cubic: f64, shaped: bool) -> Result<LegModel, String> {
    let still = &model.still;
    let nodes = still.nodes.iter().map(|node| node * (1.0 + gain)).collect();
    let creep = || model.creep.iter().map(|term| [term.time_constant, term.weight]).collect();
    let around = match &model.around {
        Some(around) => Some(around.clone()),
        None => (shaped || cubic != 0.0).then(|| Around { creep: creep(), ..Around::of_table(still) }),
    };
    let around = around.map(|around| around.refitted(1.0 + gain, cubic)).transpose()?;
    Ok(LegModel { table: EverettTable { nodes, ..still.clone() }, around })
}

/// A run beside the displacement of the model.
struct Signals<'a> {
    time: &'a [f64],
    voltage: &'a [f64],
    measured: &'a [f64],
    model: &'a [f64],
    keep: Vec<bool>,
    stroke: f64,
    delay: f64,
}

/// A fit of some of the numbers.
struct Solution {
    /// Of gain, delay (s) and cubic term; 0 for those that are not fitted.
    changes: [f64; 3],
    errors: [f64; 3],
    /// At every sample, m; 0 for samples that do not count.
    residual: Vec<f64>,
    rms: f64,
}

impl<'a> Signals<'a> {
    fn of(model: &RateModel, run: &LegRun<'a>, predicted: &'a Prediction) -> Option<Self> {
        let from = predicted.samples_skipped;
        let time = &run.time[from..];
        // Earlier samples follow voltages from before the run.
        let begun = time.first()? + run.delay + SPREAD[1];
        let table = model.still.node(model.still.grid, 0);
        let signals = Self {
            time,
            voltage: &run.voltage[from..],
            measured: &run.displacement[from..],
            model: &predicted.displacement,
            keep: predicted.keep.iter().zip(time).map(|(keep, t)| *keep && *t >= begun).collect(),
            stroke: model.around.as_ref().map_or(table, |around| around.travel_um * 1e-6),
            delay: run.delay,
        };
        (signals.keep.iter().filter(|keep| **keep).count() >= LEAST).then_some(signals)
    }

    fn refit(&self) -> Option<LegRefit> {
        let (solution, mut numbers) = self.known()?;
        let measured = self.kept(self.measured);
        let (low, high) = extent(&measured);
        let before = self.kept(&later(self.time, self.model, self.delay));
        let off: Vec<f64> = measured.iter().zip(&before).map(|(y, p)| y - p).collect();
        let (one, time) = (vec![1.0; off.len()], self.kept(self.time));
        let gain_per_cubic = fit(&[&before, &one, &time], &self.cubic(&before))?.coefficients[0];
        let before = fit(&[&one, &time], &off)?;
        let travel = high - low;
        if travel.is_nan() || travel <= TRAVEL * solution.rms {
            numbers = [UNKNOWN; 3];
        }
        Some(LegRefit {
            gain: numbers[0],
            delay: numbers[1],
            cubic: numbers[2],
            gain_per_cubic,
            travel,
            stroke: self.stroke,
            residual_rms: solution.rms,
            residual_before: mean_square(&before.residual).sqrt(),
        })
    }

    /// The fit of the numbers that the run shows; the worst known are left out one by one, and the cubic term before the gain.
    fn known(&self) -> Option<(Solution, [Number; 3])> {
        let mut fitted = [true; 3];
        let mut numbers = [UNKNOWN; 3];
        loop {
            let found = self.solve(fitted);
            let errors = found.as_ref().map_or([f64::INFINITY; 3], |found| found.errors);
            let excess = |k: usize| errors[k] / (KNOWN * SPREAD[k]);
            // Without a solution the delay goes first, then the cubic term.
            let worst =
                [1, 2, 0].into_iter().filter(|k| fitted[*k]).reduce(|a, b| if excess(b) > excess(a) { b } else { a });
            match (worst.filter(|k| excess(*k) > 1.0 || excess(*k).is_nan()), found) {
                (Some(worst), _) => {
                    if worst == 0 && fitted[2] {
                        // Either looks like the other.
                        fitted[2] = false;
                    } else {
                        fitted[worst] = false;
                        numbers[worst].error = errors[worst];
                    }
                }
                (None, found) => {
                    let found = found?;
                    for k in (0..3).filter(|k| fitted[*k]) {
                        numbers[k] = Number { change: found.changes[k], error: found.errors[k], accepted: true };
                    }
                    return Some((found, numbers));
                }
            }
        }
    }

    /// Fits gain, delay and cubic term, those of `fitted`.
    fn solve(&self, fitted: [bool; 3]) -> Option<Solution> {
        let mut delay = self.delay;
        for _ in 0..STEPS {
            let linear = self.linear(fitted, delay)?;
            let gain = if fitted[0] { linear.coefficients[0] } else { 1.0 };
            let later = if fitted[1] { linear.coefficients[usize::from(fitted[0])] / gain } else { 0.0 };
            delay += later;
            if later.is_nan() || (delay - self.delay).abs() > 1e3 * SPREAD[1] {
                return None;
            }
            if later.abs() < SETTLED {
                return Some(self.solution(fitted, &linear, delay, gain));
            }
        }
        None
    }

    fn solution(&self, fitted: [bool; 3], linear: &Linear, delay: f64, gain: f64) -> Solution {
        let mut at = 0;
        let mut errors = [0.0; 3];
        let mut changes = [0.0; 3];
        let values = [gain - 1.0, delay - self.delay];
        let found = jackknife(&linear.columns, &linear.residual);
        for k in (0..3).filter(|k| fitted[*k]) {
            changes[k] = values.get(k).copied().unwrap_or(linear.coefficients[at]);
            errors[k] = found[at] / if k == 1 { gain.abs() } else { 1.0 };
            at += 1;
        }
        let rms = mean_square(&linear.residual).sqrt();
        if fitted[2] {
            let mut others: Vec<&[f64]> = linear.columns.iter().map(Vec::as_slice).collect();
            let cubic = others.remove(at - 1);
            if let Some(own) = fit(&others, cubic) {
                let least = LIKENESS * rms / mean_square(&own.residual).sqrt();
                errors[2] = if errors[2] > least { errors[2] } else { least };
                if fitted[0] {
                    // What passes for a cubic term is taken from the gain.
                    errors[0] = libm::hypot(errors[0], least * own.coefficients[0]);
                }
            }
        }
        let mut rest = linear.residual.iter();
        let residual = self.keep.iter().map(|keep| if *keep { rest.next().copied().unwrap_or(0.0) } else { 0.0 });
        Solution { changes, errors, residual: residual.collect(), rms }
    }

    /// Least squares at a delay (s), with those of gain, further delay times gain, and cubic term that are `fitted`.
    fn linear(&self, fitted: [bool; 3], delay: f64) -> Option<Linear> {
        let p = later(self.time, self.model, delay);
        let rate = self.kept(&rates(self.time, &p, &vec![true; p.len()]));
        let (p, u, time) = (self.kept(&p), self.kept(&later(self.time, self.voltage, delay)), self.kept(self.time));
        let mut y = self.kept(self.measured);
        if !fitted[0] {
            y.iter_mut().zip(&p).for_each(|(y, p)| *y -= p);
        }
        let (start, end) = extent(&time);
        let mut others = vec![vec![1.0; p.len()]];
        others.push(time.iter().map(|t| t - 0.5 * (start + end)).collect());
        others.push(time.iter().map(|t| libm::exp(-10.0 * (t - start) / (end - start))).collect());
        let cubic = self.cubic(&p);
        if fitted[2] {
            others.push(
                p.iter()
                    .map(|p| {
                        let s = 2.0 * p / self.stroke - 1.0;
                        self.stroke * (2.0 * s * s - 1.0)
                    })
                    .collect(),
            );
        }
        let own = core::iter::once(&p).chain(fitted[2].then_some(&cubic));
        let known: Vec<&[f64]> = own.chain(&others).map(Vec::as_slice).collect();
        let width = fit(&known, &u).map(|found| found.residual);
        // Of a voltage that the other columns explain, rounding is left.
        others.extend(width.filter(|width| dot(width, width) > 1e-12 * dot(&u, &u)));
        let later: Vec<f64> = rate.iter().map(|rate| -rate).collect();
        let own = [p, later, cubic].into_iter().zip(fitted).filter(|(_, fitted)| *fitted).map(|(column, _)| column);
        let columns: Vec<Vec<f64>> = own.chain(others).collect();
        let found = fit(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>(), &y)?;
        Some(Linear { columns, coefficients: found.coefficients, residual: found.residual })
    }

    /// H T₃ at the displacements `p`, m.
    fn cubic(&self, p: &[f64]) -> Vec<f64> {
        p.iter().map(|p| self.stroke * third(2.0 * p / self.stroke - 1.0)).collect()
    }

    fn kept(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.keep).filter(|(_, keep)| **keep).map(|(value, _)| *value).collect()
    }
}

/// A linear fit: of the numbers first.
struct Linear {
    columns: Vec<Vec<f64>>,
    coefficients: Vec<f64>,
    residual: Vec<f64>,
}

/// Standard error of each coefficient, by the jackknife over blocks: from the changes of the fit without each block. A
/// block that alone shows a coefficient makes its error infinite.
fn jackknife(columns: &[Vec<f64>], residual: &[f64]) -> Vec<f64> {
    let [few, many] = BLOCKS;
    let n = columns.len();
    let scale: Vec<f64> = columns.iter().map(|column| 1.0 / dot(column, column).sqrt()).collect();
    // Normal equations of each block for its residual.
    let blocks: Vec<(DMatrix<f64>, DVector<f64>)> = (0..many)
        .map(|b| {
            let within = b * residual.len() / many..(b + 1) * residual.len() / many;
            let of = |m: usize| &columns[m][within.clone()];
            let gram = DMatrix::from_fn(n, n, |r, c| scale[r] * scale[c] * dot(of(r), of(c)));
            (gram, DVector::from_fn(n, |r, _| scale[r] * dot(of(r), &residual[within.clone()])))
        })
        .collect();
    let sum = |of: &[(DMatrix<f64>, DVector<f64>)]| {
        let zero = (DMatrix::zeros(n, n), DVector::zeros(n));
        of.iter().fold(zero, |(gram, rhs), (more, and)| (gram + more, rhs + and))
    };
    let (whole, _) = sum(&blocks);
    let of = |size: usize| -> Vec<f64> {
        let parts = blocks.chunks(size);
        let share = 1.0 - 1.0 / parts.len() as f64;
        let mut squares = vec![0.0; n];
        for part in parts {
            let (gram, rhs) = sum(part);
            let change = Cholesky::new(&whole - gram).map(|factor| factor.solve(&rhs));
            for (k, square) in squares.iter_mut().enumerate() {
                *square += change.as_ref().map_or(f64::INFINITY, |change| change[k] * change[k] * share);
            }
        }
        squares.iter().zip(&scale).map(|(square, scale)| square.sqrt() * scale).collect()
    };
    of(1).into_iter().zip(of(many / few)).map(|(a, b)| if a > b { a } else { b }).collect()
}

#[cfg(test)]
mod tests;
