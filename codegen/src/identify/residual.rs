//! What a fitted table leaves of its own record.

use super::branches::Branch;
use super::record::Record;
use super::regressor::{self, Plane};
use super::selection::Used;
use super::{normal, sanity, trend};
use crate::everett::EverettTable;

/// Displacement minus model, from the first used sample on.
pub(crate) struct Residual {
    /// As it is, m.
    plain: Vec<f64>,
    /// Without `line`, m.
    pub(crate) detrended: Vec<f64>,
    /// Offset (m) and linear drift (m/s) of `plain`.
    pub(crate) line: trend::Line,
    /// Difference of the largest and the smallest displacement, m.
    pub(crate) range: f64,
}

impl Residual {
    /// Runs `table` over the used samples of `displacement` (m, dead time and drift already removed).
    pub(crate) fn of(plane: &Plane, record: &Record, used: &Used, displacement: &[f64], table: &EverettTable) -> Self {
        let mut plain = Vec::with_capacity(displacement.len() - used.first);
        normal::each_row(plane, &record.drive, used.first, |k, row| {
            plain.push(displacement[k] - regressor::evaluate(row, &table.nodes));
        });
        let time = &record.time[used.first..];
        let line = trend::Line::fit(time, &plain);
        let detrended = plain.iter().zip(time).map(|(r, t)| r - line.at(*t)).collect();
        let (low, high) = sanity::extent(&displacement[used.first..]);
        Self { plain, detrended, line, range: high - low }
    }

    /// Root mean square over `branches` with the mean of each branch removed, m.
    pub(crate) fn within(&self, branches: &[Branch], first: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for branch in branches {
            let part = &self.plain[branch.first - first..branch.end - first];
            let mean = part.iter().fold(0.0, |s, r| s + r) / part.len() as f64;
            sum = part.iter().fold(sum, |s, r| s + (r - mean) * (r - mean));
            count += part.len() as f64;
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }
}
