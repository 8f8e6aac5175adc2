//! The scalar type of a controller.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// `f32` or `f64`: what the kernels need of a floating-point number, and no more.
///
/// Every operation is an IEEE 754 basic operation or a comparison, so that the same inputs give the same bits on
/// every target.
pub trait Real:
    Copy
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1/2.
    const HALF: Self;
    /// 1.
    const ONE: Self;
    /// Whether this is `f32`: kernels choose their coefficients by it.
    const SINGLE: bool;

    /// The number nearest to `value`; for constants.
    fn from_f64(value: f64) -> Self;
    /// The integer part towards zero; saturates at the range of `i32`, and a NaN gives 0.
    fn truncate(self) -> i32;
    /// The number itself, exact up to 2²⁴.
    fn from_i32(value: i32) -> Self;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// Without its sign.
    fn abs(self) -> Self;
    /// The bit pattern, zero-extended: the word of traces and digests.
    fn to_word(self) -> u64;
    /// The inverse of [`Real::to_word`]; higher bits are ignored.
    fn from_word(word: u64) -> Self;
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const HALF: Self = 0.5;
    const ONE: Self = 1.0;
    const SINGLE: bool = false;

    #[inline]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline]
    fn truncate(self) -> i32 {
        self as i32
    }
    #[inline]
    fn from_i32(value: i32) -> Self {
        Self::from(value)
    }
    #[inline]
    fn is_finite(self) -> bool {
        Self::is_finite(self)
    }
    #[inline]
    fn abs(self) -> Self {
        Self::from_bits(self.to_bits() & !(1 << 63))
    }
    #[inline]
    fn to_word(self) -> u64 {
        self.to_bits()
    }
    #[inline]
    fn from_word(word: u64) -> Self {
        Self::from_bits(word)
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const HALF: Self = 0.5;
    const ONE: Self = 1.0;
    const SINGLE: bool = true;

    #[inline]
    fn from_f64(value: f64) -> Self {
        value as Self
    }
    #[inline]
    fn truncate(self) -> i32 {
        self as i32
    }
    #[inline]
    fn from_i32(value: i32) -> Self {
        value as Self
    }
    #[inline]
    fn is_finite(self) -> bool {
        Self::is_finite(self)
    }
    #[inline]
    fn abs(self) -> Self {
        Self::from_bits(self.to_bits() & !(1 << 31))
    }
    #[inline]
    fn to_word(self) -> u64 {
        u64::from(self.to_bits())
    }
    #[inline]
    fn from_word(word: u64) -> Self {
        Self::from_bits(word as u32)
    }
}

/// `value` held within `low..=high`, by comparison; a NaN gives `low`, and −0 gives +0 where `low` is 0.
#[inline]
pub fn saturate<T: Real>(value: T, low: T, high: T) -> T {
    if value > high {
        high
    } else if value > low {
        value
    } else {
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeps_its_bits<T: Real + core::fmt::Debug>(highest: u64) {
        for value in [0.0, 1.5, -2.25, 1e30, f64::NEG_INFINITY] {
            let value = T::from_f64(value);
            assert_eq!(T::from_word(value.to_word()), value);
            assert!(value.to_word() <= highest);
            assert_eq!(value.abs(), if value < T::ZERO { -value } else { value });
        }
        assert_eq!((-T::ZERO).abs().to_word(), 0);
        assert!(T::ONE.is_finite() && !T::from_f64(f64::NAN).is_finite() && !T::from_f64(f64::INFINITY).is_finite());
        assert_eq!(
            [1.9, -1.9, 1e30, -1e30, f64::NAN].map(|x| T::from_f64(x).truncate()),
            [1, -1, i32::MAX, i32::MIN, 0]
        );
        assert_eq!(T::from_i32(-7) + T::from_i32(9), T::ONE + T::ONE);
    }

    #[test]
    fn numbers_keep_their_bits_in_words() {
        keeps_its_bits::<f64>(u64::MAX);
        keeps_its_bits::<f32>(u64::from(u32::MAX));
    }

    #[test]
    fn saturation_holds_ends_and_takes_what_is_no_number_for_the_lowest() {
        for (value, held) in [(-2.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (3.0, 3.0), (4.0, 3.0), (f64::NAN, -1.0)] {
            assert_eq!(saturate(value, -1.0, 3.0), held, "{value}");
        }
        assert_eq!(saturate(-0.0_f64, 0.0, 3.0).to_bits(), 0);
    }
}
