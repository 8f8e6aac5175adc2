//! Converts numbers of the IR to the scalar of the controller.

use std::cell::Cell;
use std::marker::PhantomData;

use specgen_ir::scalar::Numbers;
use specgen_runtime::Real;

use crate::InvalidIr;

/// Converts numbers, and checks that all of them are finite.
///
/// The emitted text has the shortest decimal of the rounded number, which parses to the same bits, so only rounding is needed here.
pub struct Convert<T> {
    finite: Cell<bool>,
    scalar: PhantomData<T>,
}

impl<T: Real> Convert<T> {
    pub fn new() -> Self {
        Self { finite: Cell::new(true), scalar: PhantomData }
    }

    /// Whether every number so far was finite.
    pub fn finish(&self) -> Result<(), InvalidIr> {
        if self.finite.get() { Ok(()) } else { Err(InvalidIr::Part("a constant is not finite")) }
    }
}

impl<T: Real> Numbers<T> for Convert<T> {
    fn real(&self, value: f64) -> T {
        let value = T::from_f64(value);
        #[cfg(test)]
        let value = crate::tests::spoilt(value);
        self.finite.set(self.finite.get() && value.is_finite());
        value
    }
}
