//! Lead of a leg that compensates its dead time and its resonance.

use core::fmt::Debug;

use specgen_runtime::{Real, Snapshot};

/// A lead on a leg's demand that compensates its dead time; or none.
pub trait DeadTimeLead<T: Real>: Copy + Debug + Snapshot {
    /// No lead.
    const REST: Self;
    /// Resets the lead to zero.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// Sets the lead, m. `lead` is not called if the controller has none.
    fn ask(&mut self, lead: impl FnOnce() -> T);
    /// The lead, m.
    fn asked(&self) -> Option<T>;
}

specgen_runtime::state! { |words|
    /// A lead of one leg, or of none: `N` is 1 or 0.
    pub struct Lead<T, N>[T: Real, const N: usize] {
        /// m.
        asked: [T; N] = [T::ZERO; N], numbers(words.sizes().leg);
    }
}

/// The change of a leg's demand in the last tick, for its second difference; or nothing.
pub trait LastChange<T: Real>: Copy + Debug + Snapshot {
    /// No change.
    const REST: Self;
    /// Forgets the change.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// The second difference of the demand, m, which changes by `change` (m) in this tick.
    fn bend(&mut self, change: T) -> Option<T>;
}

specgen_runtime::state! { |words|
    /// The last change of one leg, or of none: `N` is 1 or 0.
    pub struct Change<T, N>[T: Real, const N: usize] {
        /// m.
        last: [T; N] = [T::ZERO; N], numbers(words.sizes().leg);
    }
}

impl<T: Real + Debug, const N: usize> LastChange<T> for Change<T, N> {
    const REST: Self = Self::new();
    #[inline(always)]
    fn bend(&mut self, change: T) -> Option<T> {
        let last = self.last.first_mut()?;
        let bend = change - *last;
        *last = change;
        Some(bend)
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
