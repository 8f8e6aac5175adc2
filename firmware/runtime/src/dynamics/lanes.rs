//! Numbers of several legs side by side.

use core::ops::{Add, Mul, Sub};

use crate::real::Real;

/// A number of each of `N` legs. Operations are element by element, so results do not depend on `N`.
#[derive(Clone, Copy)]
pub(super) struct Lanes<T, const N: usize>(pub [T; N]);

/// A vector of each leg.
pub(super) type Vectors<T, const N: usize> = [Lanes<T, N>; 3];

impl<T: Real, const N: usize> Lanes<T, N> {
    #[inline(always)]
    pub fn splat(value: T) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    pub fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = self;
        for (out, other) in out.0.iter_mut().zip(other.0) {
            *out = f(*out, other);
        }
        out
    }
}

impl<T: Real, const N: usize> Add for Lanes<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<T: Real, const N: usize> Sub for Lanes<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<T: Real, const N: usize> Mul for Lanes<T, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<T: Real, const N: usize> Mul<T> for Lanes<T, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: T) -> Self {
        self * Self::splat(other)
    }
}

#[inline(always)]
pub(super) fn dot<T: Real, const N: usize>(a: &Vectors<T, N>, b: &Vectors<T, N>) -> Lanes<T, N> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
