//! Six-vectors and the constant maps between them.

use crate::real::Real;

/// `matrix · vector`; every sum from the first column to the last.
#[inline]
#[must_use]
pub fn transform<T: Real>(matrix: &[[T; 6]; 6], vector: &[T; 6]) -> [T; 6] {
    let mut result = [T::ZERO; 6];
    for (value, row) in result.iter_mut().zip(matrix) {
        *value = row[0] * vector[0]
            + row[1] * vector[1]
            + row[2] * vector[2]
            + row[3] * vector[3]
            + row[4] * vector[4]
            + row[5] * vector[5];
    }
    result
}

/// `left − right`, component by component.
#[inline]
#[must_use]
pub fn difference<T: Real>(left: &[T; 6], right: &[T; 6]) -> [T; 6] {
    let mut result = *left;
    for (value, right) in result.iter_mut().zip(right) {
        *value = *value - *right;
    }
    result
}
