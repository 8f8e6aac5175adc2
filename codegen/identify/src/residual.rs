//! Residual of a fitted table on its own record, and its samples for drawing.

use super::branches::Branch;
use super::cause::{self, Cause};
use super::normal;
use super::record::Record;
use super::regressor::{self, Plane};
use super::selection::RecordSpan;
use super::staircase::Staircase;
use super::statistics::{self, Line};
use crate::everett::EverettTable;

/// Samples of an identification or a validation: columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// Drive of each sample, V.
    pub drive: Vec<f64>,
    /// Displacement shifted by the dead time, m.
    pub measured: Vec<f64>,
    /// Displacement minus model, offset and drift, m; NaN for a sample without weight.
    pub residual: Vec<f64>,
}

/// Displacement minus model, from the first used sample on.
pub(crate) struct Residual {
    /// As it is, m.
    plain: Vec<f64>,
    /// Without `line`, of the samples with weight, m.
    pub(crate) detrended: Vec<f64>,
    /// Offset (m) and linear drift (m/s) of `plain`.
    pub(crate) line: Line,
    /// Difference of the largest and the smallest displacement, m.
    pub(crate) range: f64,
}

impl Residual {
    /// Runs `table` over the used samples of `displacement` (m, dead time and drift already removed).
    pub(crate) fn of(
        plane: &Plane,
        record: &Record,
        used: &RecordSpan,
        displacement: &[f64],
        table: &EverettTable,
    ) -> Self {
        let mut plain = Vec::with_capacity(displacement.len() - used.first);
        normal::each_row(Staircase::negative_saturation(plane.range), plane, &record.drive, used.first, |k, row| {
            plain.push(displacement[k] - regressor::evaluate(row, &table.nodes));
        });
        let with_weight = |values: &[f64]| -> Vec<f64> {
            let paired = values.iter().zip(&record.weightless[used.first..]);
            paired.take(used.end - used.first).filter(|(_, weightless)| !**weightless).map(|(v, _)| *v).collect()
        };
        let (time, kept) = (with_weight(&record.time[used.first..]), with_weight(&plain));
        let line = Line::fit(&time, &kept);
        let detrended = line.removed(&time, &kept);
        let (low, high) = statistics::extent(&with_weight(&displacement[used.first..]));
        // After the end the displacement is not known.
        plain[used.end - used.first..].fill(f64::NAN);
        Self { plain, detrended, line, range: high - low }
    }

    /// Its causes, given white noise `noise` (m) and the gain (m/V).
    pub(crate) fn cause(&self, record: &Record, first: usize, noise: f64, gain: f64) -> Cause {
        let keep: Vec<bool> =
            record.weightless[first..].iter().zip(&self.plain).map(|(w, r)| !w && !r.is_nan()).collect();
        cause::explain(&record.time[first..], &record.drive[first..], &self.plain, noise, gain, &keep)
    }

    /// The samples from the first used one on, for drawing; `displacement` as given to [`Residual::of`].
    pub(crate) fn trace(&self, record: &Record, first: usize, displacement: &[f64]) -> Trace {
        let time = record.time[first..].to_vec();
        let off =
            |k: usize| if record.weightless[first + k] { f64::NAN } else { self.plain[k] - self.line.at(time[k]) };
        let residual = (0..time.len()).map(off).collect();
        Trace { time, drive: record.drive[first..].to_vec(), measured: displacement[first..].to_vec(), residual }
    }

    /// Root mean square over `branches` with the mean of each branch removed, m.
    pub(crate) fn within(&self, branches: &[Branch], first: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for branch in branches {
            let part = &self.plain[branch.first - first..branch.end - first];
            let mean = statistics::mean(part);
            sum = part.iter().fold(sum, |s, r| s + (r - mean) * (r - mean));
            count += part.len() as f64;
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }
}
