//! Six-vectors and the constant maps between them.
//!
//! # Example
//!
//! ```
//! use specgen_runtime::linear::{difference, is_within, transform};
//!
//! let mut swap = [[0.0; 6]; 6];
//! (swap[0][1], swap[1][0]) = (2.0, 1.0);
//! assert_eq!(transform(&swap, &[3.0, 5.0, 0.0, 0.0, 0.0, 0.0])[..2], [10.0, 3.0]);
//! assert_eq!(difference(&[3.0; 6], &[1.0; 6]), [2.0; 6]);
//! assert!(is_within(&[1.0; 6], &[1.0; 6]) && !is_within(&[f64::NAN; 6], &[1.0; 6]));
//! ```

use crate::real::Real;

/// [f(0), …, f(5)], written out so that the compiler knows constants at a fixed index.
#[inline(always)]
pub fn each<T>(f: impl Fn(usize) -> T) -> [T; 6] {
    [f(0), f(1), f(2), f(3), f(4), f(5)]
}

/// `matrix · vector`. Every sum runs from the first column to the last; all six run side by side, so that no product
/// waits for the one before. Zero entries are left out: with a matrix known to the compiler they cost nothing.
#[inline(always)]
#[must_use]
pub fn transform<T: Real>(matrix: &[[T; 6]; 6], vector: &[T; 6]) -> [T; 6] {
    let add = |sums: [T; 6], column: usize| each(|row| plus(sums[row], matrix[row][column], vector[column]));
    // A sum starts with −0, which leaves its first term unchanged.
    let half = add(add(add([-T::ZERO; 6], 0), 1), 2);
    add(add(add(half, 3), 4), 5)
}

#[inline(always)]
fn plus<T: Real>(sum: T, factor: T, value: T) -> T {
    if factor == T::ZERO { sum } else { sum + factor * value }
}

/// `left − right`, component by component.
#[inline]
#[must_use]
pub fn difference<T: Real>(left: &[T; 6], right: &[T; 6]) -> [T; 6] {
    each(|axis| left[axis] - right[axis])
}

/// An entry; zero if there is none.
#[inline]
#[must_use]
pub fn component<T: Real>(vector: &[T; 6], index: usize) -> T {
    match vector.get(index) {
        Some(value) => *value,
        None => T::ZERO,
    }
}

/// Whether every value is finite and within its bound.
#[inline]
#[must_use]
pub fn is_within<T: Real>(values: &[T; 6], bounds: &[T; 6]) -> bool {
    values.iter().zip(bounds).all(|(value, bound)| (-*bound..=*bound).contains(value))
}
