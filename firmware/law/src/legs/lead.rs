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

/// The change of a leg's voltage in the last tick, for its second difference; or nothing.
///
/// The mode moves with the voltage, not with the demand: for the same change of the demand, the voltage changes most
/// just after a turn, where the leg has the gain k_s of small motion. Farther from the turn the gain grows, here in
/// proportion to the distance (Rayleigh's law). Changes are in the units of small motion, k_s Δu.
pub trait LastChange<T: Real>: Copy + Debug + Snapshot {
    /// No change.
    const REST: Self;
    /// Forgets the change.
    #[inline(always)]
    fn rest(&mut self) {
        *self = Self::REST;
    }
    /// First and second difference k_s Δu, m, as the demand goes on from `before` by `change` (m). `growth` (1/m, ≥ 0)
    /// is the relative growth of the gain over the distance from the last turn.
    fn differences(&mut self, before: T, change: T, growth: T) -> Option<[T; 2]>;
}

specgen_runtime::state! { |words|
    /// The last change of one leg, or of none: `N` is 1 or 0.
    pub struct Change<T, N>[T: Real, const N: usize] {
        /// m.
        last: [T; N] = [T::ZERO; N], numbers(words.sizes().leg);
        /// Demand at the last turn, m.
        turn: [T; N] = [T::ZERO; N], numbers(words.sizes().leg);
    }
}

impl<T: Real + Debug, const N: usize> LastChange<T> for Change<T, N> {
    const REST: Self = Self::new();
    #[inline(always)]
    fn differences(&mut self, before: T, change: T, growth: T) -> Option<[T; 2]> {
        let (last, turn) = (self.last.first_mut()?, self.turn.first_mut()?);
        if (before - *turn) * change < T::ZERO {
            *turn = before;
        }
        let distance = (before - *turn) + change;
        let of_drive = change / (T::ONE + growth * distance.abs());
        let second = of_drive - *last;
        *last = of_drive;
        Some([of_drive, second])
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
