//! A motion of the platform at one instant.

use crate::real::Real;
use crate::snapshot::{LARGEST, LARGEST_PLACE};

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
}

crate::state! {
    impl[T: Real] Motion<T>, 18, |words| { pose, rate, acceleration } {
        words.numbers(pose, LARGEST_PLACE)?;
        words.numbers(rate, LARGEST)?;
        words.numbers(acceleration, LARGEST)?;
    }
}
