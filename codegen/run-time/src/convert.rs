//! Numbers of the IR in the scalar of the controller.

use std::cell::Cell;
use std::marker::PhantomData;

use specgen_runtime::Real;

use crate::InvalidIr;

/// Converts numbers and notes whether all of them were finite.
///
/// The emitted text has the shortest decimal of the number rounded to the scalar, which reads back as the same bits: rounding is all
/// that is to be done here.
pub struct Convert<T> {
    finite: Cell<bool>,
    scalar: PhantomData<T>,
}

impl<T: Real> Convert<T> {
    pub fn new() -> Self {
        Self { finite: Cell::new(true), scalar: PhantomData }
    }

    #[track_caller]
    pub fn real(&self, value: f64) -> T {
        let value = T::from_f64(value);
        #[cfg(test)]
        let value = crate::tests::spoilt(value);
        self.finite.set(self.finite.get() && value.is_finite());
        value
    }

    #[track_caller]
    pub fn vector<const N: usize>(&self, values: &[f64; N]) -> [T; N] {
        let mut converted = [T::ZERO; N];
        for (converted, value) in converted.iter_mut().zip(values) {
            *converted = self.real(*value);
        }
        converted
    }

    #[track_caller]
    pub fn matrix<const M: usize, const N: usize>(&self, rows: &[[f64; N]; M]) -> [[T; N]; M] {
        let mut converted = [[T::ZERO; N]; M];
        for (converted, row) in converted.iter_mut().zip(rows) {
            *converted = self.vector(row);
        }
        converted
    }

    /// Numbers that stay in memory.
    #[track_caller]
    pub fn slice(&self, values: &[f64]) -> &'static [T] {
        let mut converted = Vec::with_capacity(values.len());
        for value in values {
            converted.push(self.real(*value));
        }
        kept(converted)
    }

    /// Whether every number so far was finite.
    pub fn finish(&self) -> Result<(), InvalidIr> {
        if self.finite.get() { Ok(()) } else { Err(InvalidIr::Part("a constant is not finite")) }
    }
}

/// What stays in memory to the end of the process.
pub fn kept<X>(values: impl IntoIterator<Item = X>) -> &'static [X] {
    Box::leak(values.into_iter().collect())
}
