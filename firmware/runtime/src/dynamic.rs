//! The dynamic Preisach model (6), forward and inverse: q = Γ₀\[u\] + u̇ Γ₁\[u\], on one reversal memory.
//!
//! Γ₁ has an Everett table of its own, whose weights may have either sign. In the tick that ends at u, u̇ = (u − u_last)/T;
//! drives are counted in cells and rates in cells a tick, so that
//!
//! ```text
//! h(u) = Γ₀[u] + (u − u_last) Γ₁[u]
//! ```
//! The inverse solves h(u) = q between bounds from the static inverse, in at most [`DynamicMemory::ITERATIONS`] steps
//! of regula falsi (Illinois). It returns the static inverse, and sets a flag, if (6) cannot be inverted safely:
//!
//! - there is no root between the bounds, h is not monotone at the points tried, or the steps do not suffice;
//! - the rate term takes away more than half of the gain of Γ₀ since the last tick. On a straight branch of slope f'
//!   the inverse is u ← (q + Γ₁ u_last)/(f' + Γ₁). It diverges from tick to tick if Γ₁ < −f'/2.
//!
//! # Example
//!
//! Γ₀ is the table of [`crate::everett`], Γ₁ a tenth of it. In the tick in which the drive rises by 1 cell, the
//! leg moves 2 + 1 × 0.2 µm; at rest, 2 µm:
//!
//! ```
//! use specgen_runtime::{DynamicEverett, DynamicMemory, Everett};
//!
//! let still = Everett::<f64, 2, 6> { nodes: &[0.0, 2.0, 0.0, 6.0, 3.0, 0.0] };
//! let rate = Everett::<f64, 2, 6> { nodes: &[0.0, 0.2, 0.0, 0.6, 0.3, 0.0] };
//! let table = DynamicEverett { still, rate, tolerance: 1e-5 };
//! let mut leg = DynamicMemory::<f64, 8>::new();
//! assert_eq!(leg.apply(&table, 1.0), 2.2);
//! assert_eq!(leg.apply(&table, 1.0), 2.0);
//! // At rest 4.4 µm need 1.6 cells; on the way there, less: 1 + v with (2 + 4 v) + v (0.2 + 0.4 v) = 4.4.
//! let drive = leg.solve(&table, 4.4);
//! assert!(!leg.fell_back() && (drive - 1.543).abs() < 1e-3);
//! assert!((leg.apply(&table, drive) - 4.4).abs() < 1e-5);
//! ```

use crate::everett::Grid;
use crate::memory::ReversalMemory;
use crate::real::{Real, saturate};

/// The two Everett functions of one leg.
#[derive(Debug, Clone, Copy)]
pub struct DynamicEverett<T, G> {
    /// Of μ₀, the static part, m.
    pub still: G,
    /// Of μ₁, m per cell a tick; of either sign, not monotone. Only its values are used.
    pub rate: G,
    /// Largest |h − demand| that counts as solved, m.
    pub tolerance: T,
}

crate::state! { |words|
    /// Reversal memory of one leg, with Γ₁ along it. Reset: at rest, drive 0 after negative saturation.
    pub struct DynamicMemory<T, CAP>[T: Real, const CAP: usize] {
        memory: ReversalMemory<T, CAP> = ReversalMemory::new(), part;
        /// Γ₁ at each extremum of the memory, m per cell a tick.
        rate_at: [T; CAP] = [T::ZERO; CAP], stored(memory.depth(), words.sizes().leg_rate);
        /// Γ₁ at the present drive.
        rate: T = T::ZERO, number(words.sizes().leg_rate);
        /// h of the last tick, m.
        displacement: T = T::ZERO, number(words.sizes().leg);
        /// The last inverse was the static one.
        fell_back: bool = false, set;
    }
}

/// h and its parts at a drive.
#[derive(Clone, Copy)]
struct Point<T> {
    drive: T,
    /// Γ₀ − Γ₀ at the last drive, m.
    gain: T,
    /// (u − u_last) Γ₁, m.
    rate_term: T,
}

impl<T: Real, const CAP: usize> DynamicMemory<T, CAP> {
    /// Most evaluations of h within the bounds.
    pub const ITERATIONS: u32 = 12;

    /// At rest at a drive reached from below, see [`ReversalMemory::risen`], with Γ₁ = `rate` there, m per cell a tick.
    #[must_use]
    pub const fn risen(drive: T, displacement: T, rate: T) -> Self {
        let mut memory = Self::new();
        memory.memory = ReversalMemory::risen(drive, displacement);
        memory.rate = rate;
        memory.displacement = displacement;
        memory
    }

    crate::memory::present_point!();

    /// Whether the last [`DynamicMemory::solve`] returned the static inverse because (6) could not be inverted safely.
    #[inline]
    #[must_use]
    pub fn fell_back(&self) -> bool {
        self.fell_back
    }

    /// Whether the tables reach `displacement` (m) at rest.
    #[inline]
    #[must_use]
    pub fn reaches<G: Grid<T>>(&self, table: &DynamicEverett<T, G>, displacement: T) -> bool {
        displacement >= T::ZERO && displacement <= table.still.full_displacement()
    }

    /// One tick that ends at `drive` (cells, finite, limited to 0..=N). Returns the displacement of the model, m: h, or
    /// Γ₀ if the last inverse was the static one. A gauge must be compared with the model that was inverted. Otherwise a
    /// rate term too large to invert would return through the adaptation.
    #[inline]
    pub fn apply<G: Grid<T>>(&mut self, table: &DynamicEverett<T, G>, drive: T) -> T {
        let drive = saturate(drive, T::ZERO, table.still.full_scale());
        let last = self.memory.drive();
        if drive != last {
            let (dropped, depth) = (self.memory.dropped(), self.memory.depth());
            let branch = self.memory.origin(drive);
            let at_start = if branch.top < depth { self.rate_at(branch.top) } else { self.rate };
            self.memory.apply(&table.still, drive);
            if self.memory.dropped() != dropped {
                self.restore(table);
            } else if drive <= T::ZERO {
                self.rate = T::ZERO;
            } else {
                self.rate_at[if branch.top < CAP { branch.top } else { CAP - 1 }] = at_start;
                self.rate = along(&table.rate, branch.start, at_start, drive);
            }
        }
        let still = self.memory.displacement();
        self.displacement = if self.fell_back { still } else { still + (drive - last) * self.rate };
        self.displacement
    }

    /// The drive (cells) with which the next tick ends at `displacement` (m, finite): by (6), or by the static model if
    /// [`DynamicMemory::fell_back`].
    #[inline]
    pub fn solve<G: Grid<T>>(&mut self, table: &DynamicEverett<T, G>, displacement: T) -> T {
        let wanted = saturate(displacement, T::ZERO, table.still.full_displacement());
        let still = self.memory.solve(&table.still, wanted);
        let found = self.invert(table, wanted - self.memory.displacement(), still);
        self.fell_back = found.is_none();
        found.unwrap_or(still)
    }

    /// The drive at which h exceeds Γ₀ at the last drive by `wanted` (m); `still` is the drive of the static model.
    fn invert<G: Grid<T>>(&self, table: &DynamicEverett<T, G>, wanted: T, still: T) -> Option<T> {
        let last = self.memory.drive();
        let step = still - last;
        if step == T::ZERO {
            // Without a rate there is no rate term. At the end of the table, or where it is flat, this is all that is
            // reached.
            return Some(still);
        }
        let rising = wanted > T::ZERO;
        // Excess over the demand in the direction of travel: negative before the root, positive after it.
        let excess = |point: &Point<T>| {
            let h = point.gain + point.rate_term - wanted;
            if rising { h } else { -h }
        };
        let start = Point { drive: last, gain: T::ZERO, rate_term: T::ZERO };
        let middle = self.point(table, still);
        let (mut near, mut far) = if excess(&middle) >= T::ZERO {
            (start, middle)
        } else {
            let beyond = still + step + step * T::HALF;
            let end = self.point(table, saturate(beyond, T::ZERO, table.still.full_scale()));
            (middle, end)
        };
        let (mut low, mut high) = (excess(&near), excess(&far));
        if high < T::ZERO {
            return None;
        }
        // Illinois: an end that is kept twice is halved, or it would never move.
        let (mut low_weight, mut high_weight) = (low, high);
        let mut root = if high <= table.tolerance {
            Some(far)
        } else if -low <= table.tolerance {
            Some(near)
        } else {
            None
        };
        for _ in 0..Self::ITERATIONS {
            if root.is_some() {
                break;
            }
            let share = low_weight / (low_weight - high_weight);
            let try_at = near.drive + share * (far.drive - near.drive);
            let point = self.point(table, try_at);
            let at = excess(&point);
            if !(at >= low && at <= high) {
                return None;
            }
            if at.abs() <= table.tolerance {
                root = Some(point);
            } else if at < T::ZERO {
                (near, low, low_weight) = (point, at, at);
                high_weight = high_weight * T::HALF;
            } else {
                (far, high, high_weight) = (point, at, at);
                low_weight = low_weight * T::HALF;
            }
        }
        let root = root?;
        // Compares the rate term with the gain in the direction of travel.
        let (gain, rate_term) = if rising { (root.gain, root.rate_term) } else { (-root.gain, -root.rate_term) };
        (rate_term >= -(gain * T::HALF)).then_some(root.drive)
    }

    /// h and its parts at `drive`, reached from here.
    fn point<G: Grid<T>>(&self, table: &DynamicEverett<T, G>, drive: T) -> Point<T> {
        let last = self.memory.drive();
        if drive == last {
            return Point { drive, gain: T::ZERO, rate_term: T::ZERO };
        }
        if drive <= T::ZERO {
            return Point { drive: T::ZERO, gain: -self.memory.displacement(), rate_term: T::ZERO };
        }
        let branch = self.memory.origin(drive);
        let still = along(&table.still, branch.start, branch.at_start, drive);
        let at_start = if branch.top < self.memory.depth() { self.rate_at(branch.top) } else { self.rate };
        let rate = along(&table.rate, branch.start, at_start, drive);
        Point { drive, gain: still - self.memory.displacement(), rate_term: (drive - last) * rate }
    }

    /// Recomputes Γ₁ at every extremum after the full memory dropped a pair.
    #[cold]
    #[inline(never)]
    fn restore<G: Grid<T>>(&mut self, table: &DynamicEverett<T, G>) {
        let depth = self.memory.depth();
        let mut at = T::ZERO;
        for k in 0..CAP {
            if k >= depth {
                break;
            }
            if k > 0 {
                at = along(&table.rate, self.memory.extremum(k - 1), at, self.memory.extremum(k));
            }
            self.rate_at[k] = at;
        }
        let top = if depth > 0 { depth - 1 } else { 0 };
        self.rate = along(&table.rate, self.memory.extremum(top), at, self.memory.drive());
    }

    /// Bounded read.
    #[inline]
    fn rate_at(&self, k: usize) -> T {
        self.rate_at[if k < CAP { k } else { CAP - 1 }]
    }
}

/// The value at `drive` on the branch from `start`, where it is `at_start`.
#[inline]
fn along<T: Real, G: Grid<T>>(table: &G, start: T, at_start: T, drive: T) -> T {
    if drive > start { at_start + table.value(drive, start) } else { at_start - table.value(start, drive) }
}
