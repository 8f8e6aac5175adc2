//! Columns that belong to a record: an offset, a line, and the start states of creep and mode.
//!
//! A creep operator that does not start at rest adds a e^(−t/τ); a mode that still rings adds a decaying oscillation.
//! Both are linear in the unknown start state, so they are estimated with the model, for each record separately, and do
//! not count as its error.

use crate::mode::Mode;

/// Columns of a record, orthonormal over the samples that count.
pub(crate) struct RecordColumns {
    basis: Vec<Vec<f64>>,
    /// Number of these that are offset and line.
    plain: usize,
    keep: Vec<bool>,
}

/// A column whose remainder after the ones before it is below this fraction (of the length) has no information.
const NEW: f64 = 1e-3;

impl RecordColumns {
    /// Over samples at `time` (s) of which those of `keep` count, for creep of `times` (s).
    pub(crate) fn of(time: &[f64], keep: Vec<bool>, times: impl Iterator<Item = f64>, mode: Option<Mode>) -> Self {
        let start = time.first().copied().unwrap_or(0.0);
        let end = time.last().copied().unwrap_or(0.0);
        let mut own = Self { basis: Vec::new(), plain: 0, keep };
        own.add(vec![1.0; time.len()]);
        own.add(time.iter().map(|t| t - 0.5 * (start + end)).collect());
        own.plain = own.basis.len();
        for tau in times {
            own.add(time.iter().map(|t| libm::exp((start - t) / tau)).collect());
        }
        mode.iter().flat_map(|mode| mode.ring(time)).for_each(|phase| own.add(phase));
        own
    }

    fn add(&mut self, mut column: Vec<f64>) {
        let before = self.dot(&column, &column);
        // Twice, to remove the rounding of the first time.
        self.take_out(&mut column);
        self.take_out(&mut column);
        let after = self.dot(&column, &column);
        if after > NEW * NEW * before {
            let unit = 1.0 / after.sqrt();
            column.iter_mut().for_each(|x| *x *= unit);
            self.basis.push(column);
        }
    }

    /// `values` without the part that these columns explain.
    pub(crate) fn take_out(&self, values: &mut [f64]) {
        self.without(0, values);
    }

    /// `values` without the part that the start state explains: offset and line stay.
    pub(crate) fn take_out_start(&self, values: &mut [f64]) {
        self.without(self.plain, values);
    }

    fn without(&self, first: usize, values: &mut [f64]) {
        for column in &self.basis[first..] {
            let share = self.dot(column, values);
            values.iter_mut().zip(column).for_each(|(y, x)| *y -= share * x);
        }
    }

    /// Over the selected samples.
    pub(crate) fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.keep).fold(0.0, |sum, ((x, y), keep)| if *keep { sum + x * y } else { sum })
    }
}
