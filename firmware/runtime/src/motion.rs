//! A motion of the platform at one instant.

use crate::real::Real;

crate::state! { |words|
    /// Six coordinates with their first and second time derivatives. Standstill at rest at reset.
    #[derive(PartialEq)]
    pub struct Motion<T>[T: Real] {
        /// m and rad.
        pub pose: [T; 6] = [T::ZERO; 6], axes(words.sizes().place);
        /// m/s and rad/s.
        pub rate: [T; 6] = [T::ZERO; 6], axes(words.sizes().rate);
        /// m/s² and rad/s².
        pub acceleration: [T; 6] = [T::ZERO; 6], axes(words.sizes().acceleration);
    }
}

impl<T: Real> Motion<T> {
    /// Standstill at `pose` (m and rad).
    #[must_use]
    pub const fn at(pose: [T; 6]) -> Self {
        Self { pose, rate: [T::ZERO; 6], acceleration: [T::ZERO; 6] }
    }
}
