//! Functions of time with their first two derivatives: a formula written once yields all three, exactly.

use core::ops::{Add, Mul, Neg, Sub};

/// A value, its rate and its acceleration at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jet {
    pub value: f64,
    pub rate: f64,
    pub acceleration: f64,
}

impl Jet {
    /// Time itself.
    pub fn time(t: f64) -> Self {
        Self { value: t, rate: 1.0, acceleration: 0.0 }
    }

    pub fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, acceleration: 0.0 }
    }

    pub fn sin(self) -> Self {
        let (s, c) = (libm::sin(self.value), libm::cos(self.value));
        Self { value: s, rate: c * self.rate, acceleration: c * self.acceleration - s * self.rate * self.rate }
    }

    pub fn cos(self) -> Self {
        let (s, c) = (libm::sin(self.value), libm::cos(self.value));
        Self { value: c, rate: -s * self.rate, acceleration: -s * self.acceleration - c * self.rate * self.rate }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            rate: self.rate + other.rate,
            acceleration: self.acceleration + other.acceleration,
        }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            acceleration: self.acceleration * other.value
                + 2.0 * self.rate * other.rate
                + self.value * other.acceleration,
        }
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, constant: f64) -> Self {
        self + Self::constant(constant)
    }
}

impl Sub<f64> for Jet {
    type Output = Self;
    fn sub(self, constant: f64) -> Self {
        self + -constant
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, rate: self.rate * factor, acceleration: self.acceleration * factor }
    }
}
