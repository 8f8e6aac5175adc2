//! A leg whose loops are smooth: one Bouc-Wen state beside the table, a polynomial read-out and creep.
//!
//! With u the drive in cells and Γ the Preisach model of [`crate::memory`],
//!
//! ```text
//! P = Γ[u] − (z − z₀)        dz = (a − β s z − γ |z|) du,  s = sign du          all in m; z₀ at rest
//! h = F(P)                   P = G(h), a polynomial that rises over the travel
//! y = h + Σ w_j x_j          x_j ← x_j + g_j (h − x_j), as in [`crate::creep`]
//! ```
//! Bouc (1967) and Wen (1976), exponent 1. |z| ≤ a/(β + γ). Legs whose Γ is a straight line are Bouc-Wen legs; with
//! a = 0 the rest is a table with read-out and creep.
//!
//! The inverse goes the same way back: h from the demand without the creep of the states, P = G(h), and
//! u = Γ⁻¹(P + z − z₀) with z one tick ahead at the drive's last step. It needs no iteration and no division. The step
//! of the drive hardly changes from tick to tick, so that what z misses is of second order: about 1 nm at 20 Hz and
//! 15 µm. The forward model then takes the step that was really made, in second order (midpoint), so that q̂ has no such
//! error. The explicit state is stable where the leg is monotone: where the slope of Γ is above that of z.
//!
//! # Example
//!
//! Γ is a line of 3 µm a cell, a third of which the state takes after each reversal.
//!
//! ```
//! use specgen_runtime::{BoucWen, BoucWenEverett, BoucWenMemory, Creep, Everett};
//!
//! let still = Everett::<f64, 2, 6> { nodes: &[0.0, 3.0, 0.0, 6.0, 3.0, 0.0] };
//! let around = BoucWen::<f64, 0> {
//!     creep: Creep { gains: [], weights: [], carried: [], direct: 1.0 },
//!     share: 1.0,
//!     read_out: [1.0, 0.0, 0.0, 0.0, 0.0],
//!     inverse: [1.0, 0.0, 0.0, 0.0, 0.0],
//!     travel: [-1.0, 6.0],
//!     slope: 1.0,
//!     beta_plus_gamma: 4.0,
//!     beta_minus_gamma: 0.0,
//!     limit: 0.25,
//!     rest: -0.25,
//! };
//! let table = BoucWenEverett { still, around: &around };
//! let mut leg = BoucWenMemory::<f64, 8, 0>::new(-0.25);
//! let mut last = 0.0;
//! for step in 1..=100 {
//!     last = leg.apply(&table, f64::from(step) * 0.01);
//! }
//! // 3 µm, less what the state has taken on the way: nearly from −1/4 to 1/4.
//! assert!((last - 2.51).abs() < 0.01);
//! // The drive for a little less displacement: after the reversal the leg moves by 3 − 2 µm a cell.
//! let drive = leg.solve(&table, last - 0.01);
//! assert!(drive < 1.0 && drive > 0.98);
//! ```

use crate::crc::Crc32;
use crate::creep::Creep;
use crate::everett::{Grid, LastLine};
use crate::memory::ReversalMemory;
use crate::real::{Real, saturate};
use crate::snapshot::LARGEST;

/// Coefficients of a read-out: of the powers 1 to 5.
pub const READ_OUT: usize = 5;

/// What is around the table of one leg, with `K` creep operators.
#[derive(Debug, Clone, Copy)]
pub struct BoucWen<T, const K: usize> {
    /// Creep after the rest.
    pub creep: Creep<T, K>,
    /// 1/(1 + Σ w_j g_j).
    pub share: T,
    /// G: coefficients of h, h², …
    pub read_out: [T; READ_OUT],
    /// F: those of its inverse, likewise.
    pub inverse: [T; READ_OUT],
    /// Lowest and highest h at which G is used, m.
    pub travel: [T; 2],
    /// a: what z takes of a small step after a reversal from z = 0, m per cell.
    pub slope: T,
    /// β + γ: how fast z saturates in the direction of its sign, per cell.
    pub beta_plus_gamma: T,
    /// β − γ: the same against its sign.
    pub beta_minus_gamma: T,
    /// a/(β + γ), m.
    pub limit: T,
    /// z₀, m.
    pub rest: T,
}

impl<T: Real, const K: usize> BoucWen<T, K> {
    /// Adds its numbers to a checksum.
    pub fn checksum(&self, crc: &mut Crc32) {
        self.creep.checksum(crc);
        crc.reals(&[self.share]);
        crc.reals(&self.read_out);
        crc.reals(&self.inverse);
        crc.reals(&self.travel);
        crc.reals(&[self.slope, self.beta_plus_gamma, self.beta_minus_gamma, self.limit, self.rest]);
    }

    /// dz/du at `z`, in the direction of `step`.
    #[inline(always)]
    fn rate(&self, z: T, step: T) -> T {
        let along = if step < T::ZERO { -z } else { z };
        self.slope - if along < T::ZERO { self.beta_minus_gamma } else { self.beta_plus_gamma } * along
    }
}

/// Everett function of one leg, and what is around it.
#[derive(Debug, Clone, Copy)]
pub struct BoucWenEverett<'a, T, G, const K: usize> {
    /// Γ.
    pub still: G,
    /// The rest.
    pub around: &'a BoucWen<T, K>,
}

crate::state! { |words|
    /// Reversal memory, Bouc-Wen state and creep states of one leg. Reset: at rest, drive 0 after negative saturation
    /// with z = `rest`, no creep left.
    pub struct BoucWenMemory<T, CAP, K>[T: Real, const CAP: usize, const K: usize](rest: T) {
        memory: ReversalMemory<T, CAP> = ReversalMemory::new(), part;
        /// z, m.
        z: T = rest, number(words.sizes().leg);
        /// Last step of the drive, cells.
        step: T = T::ZERO, number(LARGEST);
        /// x_j, m.
        states: [T; K] = [T::ZERO; K], numbers(words.sizes().leg);
        /// y at the end of the tick, m.
        displacement: T = T::ZERO, number(words.sizes().leg);
    }
}

impl<T: Real, const CAP: usize, const K: usize> BoucWenMemory<T, CAP, K> {
    /// At a drive just reached from below, see [`ReversalMemory::risen`]: `still` of the table, `z`, and
    /// `displacement` without creep, m.
    #[must_use]
    pub const fn risen(drive: T, still: T, z: T, displacement: T) -> Self {
        let mut memory = Self::new(z);
        memory.memory = ReversalMemory::risen(drive, still);
        memory.displacement = displacement;
        memory
    }

    /// The drive last applied, cells.
    #[inline]
    #[must_use]
    pub fn drive(&self) -> T {
        self.memory.drive()
    }

    /// The displacement that the model gives at the end of the tick over which the last drive is held, m.
    #[inline]
    #[must_use]
    pub fn displacement(&self) -> T {
        self.displacement
    }

    /// One tick with `drive` (cells, finite, held within 0..=N); returns the displacement at its end, m.
    #[inline]
    pub fn apply<G: Grid<T>>(&mut self, table: &BoucWenEverett<'_, T, G, K>, drive: T) -> T {
        let before = self.memory.drive();
        self.memory.apply(&table.still, drive);
        self.advance(table, before);
        self.displacement
    }

    /// The drive (cells) with which the next tick ends at `displacement` (m, finite), as near as the table reaches.
    #[inline]
    #[must_use]
    pub fn solve<G: Grid<T>>(&self, table: &BoucWenEverett<'_, T, G, K>, displacement: T) -> T {
        self.memory.solve(&table.still, self.still_part(table, displacement).0)
    }

    /// Whether the table reaches `displacement` (m) from the present state.
    #[inline]
    #[must_use]
    pub fn reaches<G: Grid<T>>(&self, table: &BoucWenEverett<'_, T, G, K>, displacement: T) -> bool {
        let (still, within) = self.still_part(table, displacement);
        within && self.memory.reaches(&table.still, still)
    }

    /// As [`ReversalMemory::follow_within`].
    #[inline(always)]
    pub fn follow_within<G: Grid<T>>(
        &mut self,
        table: &BoucWenEverett<'_, T, G, K>,
        displacement: T,
        permitted: impl FnOnce(T) -> T,
    ) -> bool {
        let before = self.memory.drive();
        let (still, within) = self.still_part(table, displacement);
        let beyond = self.memory.follow_within(&table.still, still, permitted);
        self.advance(table, before);
        beyond || !within
    }

    /// As [`ReversalMemory::track`].
    #[inline(always)]
    pub fn track<G: Grid<T>>(
        &mut self,
        table: &BoucWenEverett<'_, T, G, K>,
        last: &mut LastLine<T>,
        displacement: T,
        permitted: impl FnOnce(T) -> Option<T>,
    ) -> bool {
        let before = self.memory.drive();
        let (still, within) = self.still_part(table, displacement);
        let tracked = within && self.memory.track(&table.still, last, still, permitted);
        if tracked {
            self.advance(table, before);
        }
        tracked
    }

    /// Output of Γ that gives `displacement` at the end of the next tick, m, not limited by the table; and whether the
    /// read-out reaches it.
    #[inline(always)]
    fn still_part<G: Grid<T>>(&self, table: &BoucWenEverett<'_, T, G, K>, displacement: T) -> (T, bool) {
        let around = table.around;
        let mut rest = displacement;
        for (state, carried) in self.states.iter().zip(&around.creep.carried) {
            rest = rest - *carried * *state;
        }
        let wanted = rest * around.share;
        let h = saturate(wanted, around.travel[0], around.travel[1]);
        let ahead = self.z + self.step * around.rate(self.z, self.step);
        (polynomial(&around.read_out, h) + (ahead - around.rest), h == wanted)
    }

    /// z, creep and displacement after the drive has gone from `before` to the present one.
    #[inline(always)]
    fn advance<G: Grid<T>>(&mut self, table: &BoucWenEverett<'_, T, G, K>, before: T) {
        let around = table.around;
        self.step = self.memory.drive() - before;
        let middle = self.z + T::HALF * self.step * around.rate(self.z, self.step);
        let z = self.z + self.step * around.rate(middle, self.step);
        self.z = saturate(z, -around.limit, around.limit);
        let h = polynomial(&around.inverse, self.memory.displacement() - (self.z - around.rest));
        let h = saturate(h, around.travel[0], around.travel[1]);
        let mut displacement = h;
        for ((state, gain), weight) in self.states.iter_mut().zip(&around.creep.gains).zip(&around.creep.weights) {
            *state = *state + *gain * (h - *state);
            displacement = displacement + *weight * *state;
        }
        self.displacement = displacement;
    }
}

/// c₁ x + c₂ x² + …
#[inline(always)]
fn polynomial<T: Real>(coefficients: &[T; READ_OUT], x: T) -> T {
    let [first, second, third, fourth, fifth] = *coefficients;
    x * (first + x * (second + x * (third + x * (fourth + x * fifth))))
}
