//! Numbers with an enclosure and an error bound: the kernels of the controller, run on them, give a bound on their own rounding
//! errors over a whole box of inputs.
//!
//! What the controller computes lies in [low, high]; what it would compute without any rounding differs from that by `error` at
//! most. Every operation adds half a last bit of the largest magnitude its result may have (the running error analysis of
//! Wilkinson, with intervals in place of values).

use core::cmp::Ordering;
use core::ops::{Add, Div, Mul, Neg, Sub};

use specgen_runtime::Real;

/// `SINGLE`: the controller computes in `f32`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosed<const SINGLE: bool> {
    low: f64,
    high: f64,
    error: f64,
}

/// The bounds themselves are computed in doubles: a part in 10¹³ covers that.
const ROUND_UP: f64 = 1.0 + 1e-13;
/// Exponent bits of a double: what is left of a positive number is the power of two below it.
const EXPONENT: u64 = 0x7ff0_0000_0000_0000;

impl<const SINGLE: bool> Enclosed<SINGLE> {
    /// Half a last bit of 1.
    const UNIT: f64 = if SINGLE { 5.960_464_477_539_063e-8 } else { 1.110_223_024_625_156_5e-16 };

    /// Inputs anywhere from `low` to `high`, exact.
    #[must_use]
    pub const fn input(low: f64, high: f64) -> Self {
        Self { low, high, error: 0.0 }
    }

    /// A constant of the controller that differs from what it stands for by `error`.
    #[must_use]
    pub const fn constant(value: f64, error: f64) -> Self {
        Self { low: value, high: value, error }
    }

    /// Largest magnitude.
    #[must_use]
    pub fn magnitude(self) -> f64 {
        let (a, b) = (self.low.abs(), self.high.abs());
        if a > b { a } else { b }
    }

    /// By how much what is computed may be off.
    #[must_use]
    pub const fn error(self) -> f64 {
        self.error
    }

    /// An exact value, if it is a single one.
    fn point(self) -> Option<f64> {
        (self.low == self.high && self.error == 0.0).then_some(self.low)
    }

    /// The result of an operation with ends `low` and `high` and the errors of its operands.
    fn rounded(low: f64, high: f64, error: f64) -> Self {
        let exact = Self { low, high, error };
        // Half a last bit is the same all over a binade: that of its lower end.
        let largest = exact.magnitude() * ROUND_UP;
        let half_bit = Self::UNIT * f64::from_bits(largest.to_bits() & EXPONENT);
        Self { low: low - half_bit, high: high + half_bit, error: (error + half_bit) * ROUND_UP }
    }
}

impl<const SINGLE: bool> Add for Enclosed<SINGLE> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        // Nothing is rounded where nothing is added.
        match (self.point(), other.point()) {
            (Some(0.0), _) => other,
            (_, Some(0.0)) => self,
            _ => Self::rounded(self.low + other.low, self.high + other.high, self.error + other.error),
        }
    }
}

impl<const SINGLE: bool> Neg for Enclosed<SINGLE> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low, error: self.error }
    }
}

impl<const SINGLE: bool> Sub for Enclosed<SINGLE> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

/// A factor by which products are exact.
fn is_power_of_two(value: f64) -> bool {
    value != 0.0 && value.is_normal() && value.to_bits().trailing_zeros() >= 52
}

impl<const SINGLE: bool> Mul for Enclosed<SINGLE> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        for (a, b) in [(self, other), (other, self)] {
            match a.point() {
                Some(0.0) => return a,
                Some(factor) if is_power_of_two(factor) => {
                    let (x, y) = (b.low * factor, b.high * factor);
                    let (low, high) = if x < y { (x, y) } else { (y, x) };
                    return Self { low, high, error: b.error * factor.abs() };
                }
                _ => {}
            }
        }
        let ends = [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high];
        let low = ends.into_iter().fold(f64::INFINITY, |a, b| if b < a { b } else { a });
        let high = ends.into_iter().fold(f64::NEG_INFINITY, |a, b| if b > a { b } else { a });
        let error = self.magnitude() * other.error + other.magnitude() * self.error + self.error * other.error;
        Self::rounded(low, high, error)
    }
}

impl<const SINGLE: bool> Div for Enclosed<SINGLE> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let (a, b) = (other.low.abs(), other.high.abs());
        let nearest = if a < b { a } else { b };
        if other.low <= 0.0 && other.high >= 0.0 || nearest <= other.error {
            return Self { low: f64::NEG_INFINITY, high: f64::INFINITY, error: f64::INFINITY };
        }
        let ends = [self.low / other.low, self.low / other.high, self.high / other.low, self.high / other.high];
        let low = ends.into_iter().fold(f64::INFINITY, |a, b| if b < a { b } else { a });
        let high = ends.into_iter().fold(f64::NEG_INFINITY, |a, b| if b > a { b } else { a });
        let quotient = if low.abs() > high.abs() { low.abs() } else { high.abs() };
        let error = (self.error + quotient * other.error) / (nearest - other.error);
        Self::rounded(low, high, error)
    }
}

impl<const SINGLE: bool> PartialOrd for Enclosed<SINGLE> {
    /// By enclosures that do not overlap; the kernels that are run on this type compare with zero constants only.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        if self == other {
            Some(Ordering::Equal)
        } else if self.high < other.low {
            Some(Ordering::Less)
        } else if self.low > other.high {
            Some(Ordering::Greater)
        } else {
            None
        }
    }
}

impl<const SINGLE: bool> Real for Enclosed<SINGLE> {
    const ZERO: Self = Self::constant(0.0, 0.0);
    const HALF: Self = Self::constant(0.5, 0.0);
    const ONE: Self = Self::constant(1.0, 0.0);
    const SINGLE: bool = SINGLE;

    fn from_f64(value: f64) -> Self {
        let kept = if SINGLE { f64::from(value as f32) } else { value };
        Self::constant(kept, (kept - value).abs())
    }
    fn truncate(self) -> i32 {
        self.low as i32
    }
    fn from_i32(value: i32) -> Self {
        Self::from_f64(f64::from(value))
    }
    fn is_finite(self) -> bool {
        self.magnitude().is_finite() && self.error.is_finite()
    }
    fn abs(self) -> Self {
        Self { low: 0.0, high: self.magnitude(), error: self.error }
    }
    fn to_word(self) -> u64 {
        self.low.to_bits()
    }
    fn from_word(word: u64) -> Self {
        Self::from_f64(f64::from_bits(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Single = Enclosed<true>;

    #[test]
    fn single_precision_stays_within_its_bound_and_near_it() {
        // x² − y² where much cancels: f32 against f64.
        let (low, high) = (1.0, 1.001);
        let x = Single::input(low, high);
        let bound = (x * x - x * x).error();
        let mut worst = 0.0_f64;
        for k in 0..2000_u32 {
            let a = (low + (high - low) * f64::from(k) / 2000.0) as f32;
            let b = (high - (high - low) * f64::from(k * 7 % 2000) / 2000.0) as f32;
            let exact = f64::from(a) * f64::from(a) - f64::from(b) * f64::from(b);
            worst = worst.max((f64::from(a * a - b * b) - exact).abs());
        }
        assert!(worst <= bound && bound < 4.0 * worst, "{worst:e} {bound:e}");
    }

    #[test]
    fn a_divisor_that_may_be_zero_has_no_bound() {
        assert!(!(Single::ONE / Single::input(-1.0, 1.0)).is_finite());
        let good = Single::ONE / Single::input(2.0, 4.0);
        assert!(good.is_finite() && good.magnitude() >= 0.5);
    }

    #[test]
    fn exact_operations_have_no_error() {
        let x = Single::input(-3.0, 5.0);
        assert_eq!((x * Single::HALF).error(), 0.0);
        assert_eq!((x + Single::ZERO).error(), 0.0);
        assert!((x + x).error() > 0.0);
        assert!(Single::from_f64(0.1).error() > 0.0);
    }
}
