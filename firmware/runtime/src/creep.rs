//! Rate dependence as creep behind the static model (Hammerstein): Preisach first, then linear dynamics.
//!
//! With f = Γ\[u\] the displacement of the static model, held over a tick of length T,
//!
//! ```text
//! ẋ_j = (f − x_j)/τ_j          x_j ← x_j + g_j (f − x_j),   g_j = 1 − e^(−T/τ_j)      exact for a held drive
//! y   = f + Σ w_j x_j          at the end of the tick, w_j ≥ 0
//! ```
//! The inverse solves the same equation for f. It subtracts the creep of the states from the demand and passes the rest
//! through Γ⁻¹: f = (y − Σ w_j (1 − g_j) x_j)/(1 + Σ w_j g_j). One division, no iteration.
//!
//! Each state is a mean of past f with positive weights, so it stays within the range of the table at any demand.
//!
//! # Example
//!
//! With the table of [`crate::everett`] and one creep operator, g = 1/2 and w = 1/4: under a held drive the leg creeps
//! from 6 µm towards 6 (1 + 1/4) = 7.5 µm, half of the remaining distance in each tick.
//!
//! ```
//! use specgen_runtime::{Creep, CreepEverett, CreepMemory, Everett};
//!
//! let still = Everett::<f64, 2, 6> { nodes: &[0.0, 2.0, 0.0, 6.0, 3.0, 0.0] };
//! let creep = Creep { gains: [0.5], weights: [0.25], carried: [0.125], direct: 1.125 };
//! let table = CreepEverett { still, creep: &creep };
//! let mut leg = CreepMemory::<f64, 8, 1>::new();
//! assert_eq!(leg.apply(&table, 2.0), 6.75); // 6 + 3/4
//! assert_eq!(leg.apply(&table, 2.0), 7.125); // 6 + 4.5/4
//! // To stay at 7.125 µm the drive has to fall.
//! let drive = leg.solve(&table, 7.125);
//! assert!(drive < 2.0);
//! assert!((leg.apply(&table, drive) - 7.125).abs() < 1e-12);
//! ```

use crate::crc::Crc32;
use crate::everett::Grid;
use crate::memory::ReversalMemory;
use crate::real::{Real, saturate};

/// `K` creep operators in parallel, for a given length of the tick.
#[derive(Debug, Clone, Copy)]
pub struct Creep<T, const K: usize> {
    /// g_j: fraction of the distance to f that a state covers in a tick, within (0, 1\].
    pub gains: [T; K],
    /// w_j ≥ 0.
    pub weights: [T; K],
    /// w_j (1 − g_j): weight of the present x_j in y at the end of the tick.
    pub carried: [T; K],
    /// 1 + Σ w_j g_j: weight of f in y at the end of the tick.
    pub direct: T,
}

impl<T: Real, const K: usize> Creep<T, K> {
    /// Adds its numbers to a checksum.
    pub fn checksum(&self, crc: &mut Crc32) {
        crc.reals(&self.gains);
        crc.reals(&self.weights);
        crc.reals(&self.carried);
        crc.reals(&[self.direct]);
    }

    /// `displacement` without the part that the present `states` contribute at the end of the next tick, m.
    #[inline(always)]
    pub(crate) fn without_carried(&self, states: &[T; K], displacement: T) -> T {
        let mut remainder = displacement;
        for (state, carried) in states.iter().zip(&self.carried) {
            remainder = remainder - *carried * *state;
        }
        remainder
    }
}

/// Everett function of one leg, followed by creep.
#[derive(Debug, Clone, Copy)]
pub struct CreepEverett<'a, T, G, const K: usize> {
    /// Everett function of the static model.
    pub still: G,
    /// The creep that follows.
    pub creep: &'a Creep<T, K>,
}

crate::state! { |words|
    /// Reversal memory and creep states of one leg. Reset: at rest, drive 0 after negative saturation, no creep left.
    pub struct CreepMemory<T, CAP, K>[T: Real, const CAP: usize, const K: usize] {
        memory: ReversalMemory<T, CAP> = ReversalMemory::new(), part;
        /// x_j: creep states, m.
        states: [T; K] = [T::ZERO; K], numbers(words.sizes().leg);
        /// y at the end of the tick, m.
        displacement: T = T::ZERO, number(words.sizes().leg);
    }
}

impl<T: Real, const CAP: usize, const K: usize> CreepMemory<T, CAP, K> {
    /// The state at a drive just reached from below, see [`ReversalMemory::risen`], before any creep.
    #[must_use]
    pub const fn risen(drive: T, displacement: T) -> Self {
        let mut memory = Self::new();
        memory.memory = ReversalMemory::risen(drive, displacement);
        memory.displacement = displacement;
        memory
    }

    crate::memory::present_point!();

    /// x_j, m: within 0 and the full displacement of the table.
    #[must_use]
    pub fn states(&self) -> &[T; K] {
        &self.states
    }

    /// One tick with `drive` (cells, finite, held within 0..=N); returns the displacement at its end, m.
    #[inline]
    pub fn apply<G: Grid<T>>(&mut self, table: &CreepEverett<'_, T, G, K>, drive: T) -> T {
        let still = self.memory.apply(&table.still, drive);
        let full = table.still.full_displacement();
        let mut displacement = still;
        for ((state, gain), weight) in self.states.iter_mut().zip(&table.creep.gains).zip(&table.creep.weights) {
            *state = saturate(*state + *gain * (still - *state), T::ZERO, full);
            displacement = displacement + *weight * *state;
        }
        self.displacement = displacement;
        displacement
    }

    /// The drive (cells) with which the next tick ends at `displacement` (m, finite), as near as the table reaches.
    #[inline]
    #[must_use]
    pub fn solve<G: Grid<T>>(&self, table: &CreepEverett<'_, T, G, K>, displacement: T) -> T {
        self.memory.solve(&table.still, self.static_demand(table, displacement))
    }

    /// Whether the table reaches `displacement` (m) from the present state.
    #[inline]
    #[must_use]
    pub fn reaches<G: Grid<T>>(&self, table: &CreepEverett<'_, T, G, K>, displacement: T) -> bool {
        let still = self.static_demand(table, displacement);
        still >= T::ZERO && still <= table.still.full_displacement()
    }

    /// f: output of the static model that gives `displacement` at the end of the next tick, m; not limited.
    #[inline]
    fn static_demand<G: Grid<T>>(&self, table: &CreepEverett<'_, T, G, K>, displacement: T) -> T {
        table.creep.without_carried(&self.states, displacement) / table.creep.direct
    }
}
