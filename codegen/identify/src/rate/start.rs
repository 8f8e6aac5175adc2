//! What a record has of its own: an offset, a line, and the state that creep and mode had at its start.
//!
//! A creep operator that starts elsewhere than at rest adds a e^(−t/τ), a mode that still rings adds a decaying oscillation: all
//! linear in what is not known, so that they are estimated with the model, for each record anew, and none of them counts as
//! its error.

use crate::mode::Mode;

/// Columns of a record, orthonormal over the samples that count.
pub(crate) struct RecordColumns {
    basis: Vec<Vec<f64>>,
    /// So many of them are offset and line.
    plain: usize,
    keep: Vec<bool>,
}

/// A column of which the ones before it leave less than this share (of the length) tells nothing more.
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
        // Twice: rounding of the first time leaves a rest.
        self.take_out(&mut column);
        self.take_out(&mut column);
        let after = self.dot(&column, &column);
        if after > NEW * NEW * before {
            let unit = 1.0 / after.sqrt();
            column.iter_mut().for_each(|x| *x *= unit);
            self.basis.push(column);
        }
    }

    /// `values` without what these columns explain.
    pub(crate) fn take_out(&self, values: &mut [f64]) {
        self.without(0, values);
    }

    /// `values` without what the state at the start explains: offset and line stay.
    pub(crate) fn take_out_start(&self, values: &mut [f64]) {
        self.without(self.plain, values);
    }

    fn without(&self, first: usize, values: &mut [f64]) {
        for column in &self.basis[first..] {
            let share = self.dot(column, values);
            values.iter_mut().zip(column).for_each(|(y, x)| *y -= share * x);
        }
    }

    /// Over the samples that count.
    pub(crate) fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.keep).fold(0.0, |sum, ((x, y), keep)| if *keep { sum + x * y } else { sum })
    }
}
