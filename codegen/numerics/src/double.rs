//! Numbers of 106 bits as unevaluated sums of two doubles: the reference for rounding errors.
//!
//! Dekker's and Knuth's error-free sums and products; the relative error of an operation is below 2⁻¹⁰⁰.

use core::cmp::Ordering;
use core::ops::{Add, Div, Mul, Neg, Sub};

use specgen_runtime::Real;
use specgen_runtime::snapshot::Field;

/// high + low, |low| ≤ half the last bit of high.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Double {
    high: f64,
    low: f64,
}

/// a + b and its rounding error, exactly.
fn two_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    let part = high - a;
    Double { high, low: (a - (high - part)) + (b - part) }
}

/// The same for |a| ≥ |b|.
fn quick_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    Double { high, low: b - (high - a) }
}

/// The upper and the lower 26 bits.
fn split(a: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// a · b and its rounding error, exactly.
fn two_product(a: f64, b: f64) -> Double {
    let high = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    Double { high, low: ((ah * bh - high) + ah * bl + al * bh) + al * bl }
}

impl Double {
    /// The double nearest to it.
    pub fn value(self) -> f64 {
        self.high + self.low
    }

    /// The square root of a non-negative number, by a Newton step from the double's.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.high <= 0.0 {
            return Self::ZERO;
        }
        let near = Self::from(libm::sqrt(self.high));
        (near + self / near) * Self::HALF
    }
}

impl From<f64> for Double {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl Add for Double {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.high, other.high), two_sum(self.low, other.low));
        let first = quick_sum(high.high, high.low + low.high);
        quick_sum(first.high, first.low + low.low)
    }
}

impl Neg for Double {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Double {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.high, other.high);
        quick_sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Double {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        let quotient = quick_sum(first, second);
        quotient + Self::from(rest.high / other.high)
    }
}

impl PartialOrd for Double {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.high.partial_cmp(&other.high) {
            Some(Ordering::Equal) => self.low.partial_cmp(&other.low),
            order => order,
        }
    }
}

impl Field for Double {
    const WORDS: usize = 1;
}

impl Real for Double {
    const ZERO: Self = Self { high: 0.0, low: 0.0 };
    const HALF: Self = Self { high: 0.5, low: 0.0 };
    const ONE: Self = Self { high: 1.0, low: 0.0 };
    const SINGLE: bool = false;

    fn from_f64(value: f64) -> Self {
        Self::from(value)
    }
    fn truncate(self) -> i32 {
        self.value() as i32
    }
    fn from_i32(value: i32) -> Self {
        Self::from(f64::from(value))
    }
    fn is_finite(self) -> bool {
        self.high.is_finite()
    }
    fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }
    fn to_word(self) -> u64 {
        self.value().to_bits()
    }
    fn from_word(word: u64) -> Self {
        Self::from(f64::from_bits(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_three_times_is_one_and_a_root_squared_is_its_number() {
        let third = Double::ONE / Double::from(3.0);
        let miss = (third * Double::from(3.0) - Double::ONE).value();
        assert!(miss.abs() < 1e-31, "{miss:e}");
        assert!(third.low != 0.0 && (third.high - 1.0 / 3.0).abs() == 0.0);
        let two = Double::from(2.0);
        let miss = (two.sqrt() * two.sqrt() - two).value();
        assert!(miss.abs() < 1e-30, "{miss:e}");
        // A plain double has an error of 1e-16, which the comparison would detect.
        let plain = Double::from(libm::sqrt(2.0));
        assert!((plain * plain - two).value().abs() > 1e-17);
    }

    #[test]
    fn what_doubles_lose_is_kept() {
        let small = Double::from(1e-25);
        assert_eq!((Double::ONE + small - Double::ONE).value(), 1e-25);
        assert!(Double::ONE + small > Double::ONE);
    }
}
