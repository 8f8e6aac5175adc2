//! The scalar type of a controller.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::field::Field;

/// `f32` or `f64`: the operations that the kernels need.
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
    + Field
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

/// `value` limited to `low..=high`, by comparison. A NaN gives `low`, and −0 gives +0 if `low` is 0.
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
