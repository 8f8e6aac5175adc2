//! Dead time between the drive column and the displacement column: amplifier lag, filters, sensor processing.
//!
//! A dead time widens the measured loop in proportion to the rate. It can be distinguished from hysteresis only when the
//! record holds branches of different rates; on a record of one rate, creep and hysteresis would be mistaken for it,
//! and the estimate is refused.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::branches::Branch;
use super::normal::{Weighting, accumulate};
use super::record::Record;
use super::regressor::Plane;
use super::{prior, statistics};

/// Ratio of the fast to the slow branches (90 % and 10 % quantile of |du/dt|) from which a dead time can be identified.
const RATE_RATIO: f64 = 2.0;
/// Longest dead time tried, sampling intervals.
const LONGEST: usize = 16;
/// Dead times tried per sampling interval.
const PER_INTERVAL: usize = 2;
/// The residual must fall by this share, or the dead time is zero.
const WORTHWHILE: f64 = 0.1;

/// Estimates the dead time in s, at most 16 sampling intervals; the text says how it was decided.
#[must_use]
pub fn estimate(plane: &Plane, record: &Record, first: usize, branches: &[Branch]) -> (f64, String) {
    let (slow, fast) = rates(record, branches);
    if fast < RATE_RATIO * slow {
        let why = format!(
            "not identifiable: the branches run at {slow:.3} to {fast:.3} V/s, less than {RATE_RATIO} times apart"
        );
        return (0.0, why);
    }
    let mut intervals: Vec<f64> = record.time.windows(2).map(|w| w[1] - w[0]).collect();
    let step = statistics::median(&mut intervals) / PER_INTERVAL as f64;
    let tried: Vec<f64> = (0..=LONGEST * PER_INTERVAL).map(|k| k as f64 * step).collect();
    let scale = 1.0 / record.displacement_range();
    let mut shifts: Vec<Shift> = tried.iter().map(|&tau| Shift { tau, next: 0 }).collect();
    let fill = |k: usize, values: &mut [f64]| {
        for (value, shift) in values.iter_mut().zip(&mut shifts) {
            *value = scale * shift.displacement(record, k);
        }
    };
    let mut normal = accumulate(plane, record, first, branches, Weighting::Even, tried.len(), fill);
    prior::add(plane.grid, &mut normal.gram);
    let Some(residual) = residuals(normal.gram, &normal.rhs, &normal.energy) else {
        return (0.0, "not identifiable: the record does not determine the table".to_owned());
    };
    let best = smallest(&residual);
    let gain = 1.0 - (residual[best] / residual[0]).sqrt();
    if best + 1 == tried.len() {
        return (0.0, format!("not credible: the fit still improves at {} s", tried[best]));
    }
    if best == 0 || gain.is_nan() || gain < WORTHWHILE {
        return (0.0, format!("none: the best one lowers the residual by less than {:.0} %", WORTHWHILE * 100.0));
    }
    let tau = tried[best] + vertex([residual[best - 1], residual[best], residual[best + 1]], step);
    (tau, format!("estimated: lowers the residual of the branches by {:.0} %", gain * 100.0))
}

/// What the best fit leaves of each target, Σ of squares; `None` if the Gram matrix is not positive definite.
pub(super) fn residuals(gram: DMatrix<f64>, rhs: &[Vec<f64>], energy: &[f64]) -> Option<Vec<f64>> {
    let factor = Cholesky::new(gram)?;
    let left = rhs.iter().zip(energy).map(|(rhs, energy)| {
        let rhs = DVector::from_column_slice(rhs);
        energy - factor.solve(&rhs).dot(&rhs)
    });
    Some(left.collect())
}

/// Place of the smallest.
pub(super) fn smallest(residual: &[f64]) -> usize {
    (0..residual.len()).fold(0, |best, k| if residual[k] < residual[best] { k } else { best })
}

/// Vertex of the parabola through three values at a distance of `step`, from the middle one.
pub(super) fn vertex([a, b, c]: [f64; 3], step: f64) -> f64 {
    0.5 * step * (a - c) / (a - 2.0 * b + c)
}

/// 10 % and 90 % quantile of the mean rates of the branches, V/s.
fn rates(record: &Record, branches: &[Branch]) -> (f64, f64) {
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

/// Displacement (m) at each sample's time + `tau` (s), interpolated; held at the last value behind the end.
#[must_use]
pub fn delayed(record: &Record, tau: f64) -> Vec<f64> {
    let mut shift = Shift { tau, next: 0 };
    (0..record.time.len()).map(|k| shift.displacement(record, k)).collect()
}

/// Reads a displacement `tau` later than asked for, for samples in ascending order.
struct Shift {
    /// s, ≥ 0.
    tau: f64,
    /// First sample that may lie behind the time asked for last.
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
