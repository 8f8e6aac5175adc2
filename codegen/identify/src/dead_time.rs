//! Dead time between the drive column and the displacement column: amplifier lag, filters, sensor processing.
//!
//! A dead time widens the measured loop in proportion to the rate. It can be distinguished from hysteresis only if the
//! record has branches of different rates. In a record of one rate, creep and hysteresis would be mistaken for a dead
//! time, and the estimate is refused.
//!
//! If the drive is a command, a converter holds each sample until the next. Half a sampling interval of the estimate
//! then belongs to the hold and not to the actuator: [`Record::held`].

use nalgebra::DMatrix;
use specgen_numerics::Factor;

use super::branches::Branch;
use super::normal::{Weighting, accumulate};
use super::prior;
use super::record::Record;
use super::regressor::Plane;
use super::statistics::{extent, median, noise_floor};

/// Least ratio of the fast to the slow branches (90 % and 10 % quantile of |du/dt|) for an estimate of the dead time.
pub(crate) const RATE_RATIO: f64 = 2.0;
/// Longest dead time tried, s, and as a fraction of a fast branch: half a cycle later, a table of negative weights fits
/// as well.
const LONGEST: f64 = 8e-3;
const OF_BRANCH: f64 = 0.5;
/// Intervals of the first search, and of the second one between the neighbours of the best.
const STEPS: usize = 32;
/// Number of samples used in a search; a longer record is decimated evenly.
const SAMPLES: usize = 100_000;
/// The residual above white noise must fall by this fraction, and by this many standard errors; otherwise the dead time
/// is zero.
const WORTHWHILE: f64 = 0.1;
const CERTAIN: f64 = 5.0;
/// Loops are nested if half of the rises begin above this share of the drive's range.
const NESTED: f64 = 0.05;

/// Estimates the dead time between the columns in s, at most 8 ms. The text describes the decision.
#[must_use]
pub fn estimate(plane: &Plane, record: &Record, first: usize, branches: &[Branch]) -> (f64, String) {
    let (slow, fast) = rates(record, branches);
    if fast < RATE_RATIO * slow {
        let why = format!(
            "not identifiable: the branches run at {slow:.3} to {fast:.3} V/s, less than {RATE_RATIO} times apart"
        );
        return (0.0, why);
    }
    if let Some(duration) = one_duration(record, first, branches) {
        let why = format!(
            "not identifiable: loops that grow or decay all take {:.3} ms a branch; give it with --dead-time",
            duration * 1e3
        );
        return (0.0, why);
    }
    let Some((found, samples)) = best(plane, record, first, branches) else {
        return (0.0, "not identifiable: the record does not determine the table".to_owned());
    };
    // No dead time removes white noise, and a fall within its chance shows none.
    let noise = noise_floor(&record.displacement[first..]) / record.displacement_range();
    let white = samples as f64 * noise * noise;
    let above = |square: f64| if square > white { (square - white).sqrt() } else { 0.0 };
    let certain = found.none - found.least > CERTAIN * CERTAIN * noise * noise;
    let gain = if certain { 1.0 - above(found.least) / above(found.none) } else { 0.0 };
    if found.at_end {
        let longest = longest(record, branches);
        return (0.0, format!("not credible: the fit still improves at {} ms", longest * 1e3));
    }
    if found.dead_time == 0.0 || gain.is_nan() || gain < WORTHWHILE {
        return (0.0, format!("none: the best one lowers the residual by less than {:.0} %", WORTHWHILE * 100.0));
    }
    (found.dead_time, format!("estimated: lowers the residual of the branches by {:.0} %", gain * 100.0))
}

/// The common duration of the branches (s) of a record that does not return to its lowest drive between its curves. Its
/// rate follows the size of the loop, and so does hysteresis: a dead time would be one or the other.
fn one_duration(record: &Record, first: usize, branches: &[Branch]) -> Option<f64> {
    let (low, high) = extent(&record.drive[first..]);
    let (mut starts, mut durations): (Vec<f64>, Vec<f64>) = branches
        .iter()
        .filter(|b| b.rising)
        .map(|b| (record.drive[b.first], record.time[b.end - 1] - record.time[b.first]))
        .unzip();
    durations.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| durations.get((share * durations.len() as f64) as usize).copied();
    // The first loops may be too small to count as reversals, and merge.
    let (short, long) = at(0.25).zip(at(0.75))?;
    (median(&mut starts) > low + NESTED * (high - low) && long < RATE_RATIO * short).then_some(long)
}

/// The dead time with the least residual, and the samples of the fit; `None` if the record does not determine the table.
pub(super) fn best(plane: &Plane, record: &Record, first: usize, branches: &[Branch]) -> Option<(SearchResult, usize)> {
    let scale = 1.0 / record.displacement_range();
    let every = (record.time.len() - first).div_ceil(SAMPLES);
    // Beyond this point, a longer dead time would need samples after the end of the record.
    let longest = longest(record, branches);
    let end = within(record, longest);
    let mut samples = 0;
    let found = search(longest, |tried| {
        let mut shifts: Vec<Shift> = tried.iter().map(|&tau| Shift { tau, next: 0 }).collect();
        let fill = |k: usize, values: &mut [f64]| {
            for (value, shift) in values.iter_mut().zip(&mut shifts) {
                *value = scale * shift.displacement(record, k);
            }
        };
        let weighting = Weighting::Every(every, end);
        let mut normal = accumulate(plane, record, first, branches, weighting, tried.len(), fill);
        prior::add(plane.grid, &mut normal.gram);
        samples = normal.samples;
        residuals(&normal.gram, &normal.rhs, &normal.energy)
    })?;
    Some((found, samples))
}

/// Where a search ended.
pub(super) struct SearchResult {
    /// s.
    pub(super) dead_time: f64,
    /// Σ of squares without dead time, and with the best one.
    none: f64,
    least: f64,
    /// Whether the best one is the longest tried.
    pub(super) at_end: bool,
}

/// The longest dead time that is tried in a record, s.
pub(super) fn longest(record: &Record, branches: &[Branch]) -> f64 {
    let mut durations: Vec<f64> = branches.iter().map(|b| record.time[b.end - 1] - record.time[b.first]).collect();
    durations.sort_unstable_by(f64::total_cmp);
    let fast = OF_BRANCH * durations.get(durations.len() / 10).copied().unwrap_or(0.0);
    if fast < LONGEST { fast } else { LONGEST }
}

/// The dead time up to `longest` (s) with the least `residual`, a function of the dead time (s): a coarse search, a
/// fine one around the best, then the vertex of a parabola. `None` if the residual is not known.
pub(super) fn search(longest: f64, mut residual: impl FnMut(&[f64]) -> Option<Vec<f64>>) -> Option<SearchResult> {
    let between = |from: f64, to: f64| -> Vec<f64> {
        (0..=STEPS).map(|k| from + (to - from) * k as f64 / STEPS as f64).collect()
    };
    let coarse = between(0.0, longest);
    let left = residual(&coarse)?;
    let best = smallest(&left);
    let (low, high) = (coarse[best.saturating_sub(1)], coarse[(best + 1).min(STEPS)]);
    let at_end = best == STEPS;
    let fine = between(low, high);
    let beside = residual(&fine)?;
    let near = smallest(&beside);
    let mut dead_time = fine[near];
    if near > 0 && near < STEPS {
        dead_time += vertex([beside[near - 1], beside[near], beside[near + 1]], fine[1] - fine[0]);
    }
    Some(SearchResult { dead_time, none: left[0], least: beside[near], at_end })
}

/// Samples whose displacement `tau` (s) later is still in the record.
pub(super) fn within(record: &Record, tau: f64) -> usize {
    let last = record.time[record.time.len() - 1];
    record.time.partition_point(|t| t + tau <= last)
}

/// Residual of the best fit of each target, Σ of squares; `None` if the Gram matrix is not positive definite.
pub(super) fn residuals(gram: &DMatrix<f64>, rhs: &[Vec<f64>], energy: &[f64]) -> Option<Vec<f64>> {
    let factor = Factor::of(gram.nrows(), |row, column| gram[(column, row)])?;
    let mut solutions = rhs.to_vec();
    factor.solve_all(&mut solutions);
    let left = solutions.iter().zip(rhs).zip(energy);
    Some(left.map(|((w, b), energy)| w.iter().zip(b).fold(*energy, |left, (w, b)| left - w * b)).collect())
}

/// Place of the smallest.
fn smallest(residual: &[f64]) -> usize {
    (0..residual.len()).fold(0, |best, k| if residual[k] < residual[best] { k } else { best })
}

/// Vertex of the parabola through three values spaced by `step`, relative to the middle one.
fn vertex([a, b, c]: [f64; 3], step: f64) -> f64 {
    0.5 * step * (a - c) / (a - 2.0 * b + c)
}

/// 10 % and 90 % quantile of the mean rates of the branches, V/s; of joined records, the least and the largest of all.
pub(crate) fn rates(record: &Record, branches: &[Branch]) -> (f64, f64) {
    let each = record.spans().filter_map(|span| {
        let own: Vec<Branch> = branches.iter().filter(|b| span.contains(&b.first)).copied().collect();
        (!own.is_empty()).then(|| rates_of_one(record, &own))
    });
    each.reduce(|a, b| (if b.0 < a.0 { b.0 } else { a.0 }, if b.1 > a.1 { b.1 } else { a.1 })).unwrap_or_default()
}

fn rates_of_one(record: &Record, branches: &[Branch]) -> (f64, f64) {
    let mut rates: Vec<f64> = branches
        .iter()
        .map(|b| {
            let last = b.end - 1;
            ((record.drive[last] - record.drive[b.first]) / (record.time[last] - record.time[b.first])).abs()
        })
        .collect();
    rates.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| rates.get((share * rates.len() as f64) as usize).copied().unwrap_or(0.0);
    (at(0.1), at(0.9))
}

/// Displacement (m) at each sample's time + `tau` (s), interpolated; constant after the end.
#[must_use]
pub fn delayed(record: &Record, tau: f64) -> Vec<f64> {
    let mut shift = Shift { tau, next: 0 };
    (0..record.time.len()).map(|k| shift.displacement(record, k)).collect()
}

/// Reads a displacement `tau` later than requested, for samples in ascending order.
struct Shift {
    /// s, ≥ 0.
    tau: f64,
    /// First sample that may lie after the last requested time.
    next: usize,
}

impl Shift {
    fn displacement(&mut self, record: &Record, sample: usize) -> f64 {
        let (time, y) = (&record.time, &record.displacement);
        let wanted = time[sample] + self.tau;
        while self.next < time.len() && time[self.next] < wanted {
            self.next += 1;
        }
        match (self.next.checked_sub(1), time.get(self.next)) {
            (Some(before), Some(after)) => {
                let share = (wanted - time[before]) / (after - time[before]);
                y[before] + share * (y[self.next] - y[before])
            }
            (None, _) => y[0],
            (Some(last), None) => y[last],
        }
    }
}

/// Drive (V) of a record behind a first-order lag (s, > 0), exact for straight lines between the samples.
#[must_use]
pub(super) fn lagged(record: &Record, lag: f64) -> Vec<f64> {
    let mut late: Option<f64> = None;
    let pairs = record.time.windows(2).zip(record.drive.windows(2)).map(|(t, u)| [t[1] - t[0], u[0], u[1]]);
    let first = record.drive.first().copied().map(|u| [1.0, u, u]);
    let step = |[interval, before, now]: [f64; 3]| {
        let behind = lag * (now - before) / interval;
        let value = now - behind + (late.unwrap_or(before) - before + behind) * libm::exp(-interval / lag);
        late = Some(value);
        value
    };
    first.into_iter().chain(pairs).map(step).collect()
}
