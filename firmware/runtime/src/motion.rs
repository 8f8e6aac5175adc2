//! A motion of the platform at one instant.

use crate::digest::Digest;
use crate::real::Real;

/// Six coordinates with their first and second time derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<T> {
    /// m and rad.
    pub pose: [T; 6],
    /// m/s and rad/s.
    pub rate: [T; 6],
    /// m/s² and rad/s².
    pub acceleration: [T; 6],
}

impl<T: Real> Default for Motion<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Motion<T> {
    /// Standstill at rest.
    #[must_use]
    pub const fn new() -> Self {
        Self::at([T::ZERO; 6])
    }

    /// Standstill at `pose` (m and rad).
    #[must_use]
    pub const fn at(pose: [T; 6]) -> Self {
        Self { pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] }
    }

    /// Adds the numbers to a digest.
    pub fn digest(&self, digest: &mut Digest) {
        for numbers in [&self.pose, &self.rate, &self.acceleration] {
            for number in numbers {
                digest.real(*number);
            }
        }
    }
}
