//! Numbers of the IR in the scalar of the controller.

use std::cell::Cell;
use std::marker::PhantomData;

use specgen_ir::scalar::Numbers;
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
