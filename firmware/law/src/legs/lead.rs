//! What a leg is asked for ahead of its dead time.

use core::fmt::Debug;

use specgen_runtime::{Real, Snapshot};

/// What a leg is asked for beyond the demand, so that it arrives in time; or nothing.
pub trait DeadTimeLead<T: Real>: Copy + Debug + Snapshot {
    /// None asked for.
    const REST: Self;
    /// From now on none is asked for.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// Asks for so much, m. `lead` is not called where there is none.
    fn ask(&mut self, lead: impl FnOnce() -> T);
    /// What is asked for, m.
    fn asked(&self) -> Option<T>;
}

specgen_runtime::state! { |words|
    /// A lead of one leg, or of none: `N` is 1 or 0.
    pub struct Lead<T, N>[T: Real, const N: usize] {
        /// m.
        asked: [T; N] = [T::ZERO; N], numbers(words.sizes().leg);
    }
}

impl<T: Real + Debug, const N: usize> DeadTimeLead<T> for Lead<T, N> {
    const REST: Self = Self::new();
    #[inline(always)]
    fn ask(&mut self, lead: impl FnOnce() -> T) {
        if let Some(asked) = self.asked.first_mut() {
            *asked = lead();
        }
    }
    #[inline(always)]
    fn asked(&self) -> Option<T> {
        self.asked.first().copied()
    }
}
