//! A leg model with smooth hysteresis loops: the table, one Bouc-Wen state, a polynomial read-out and creep.
//!
//! With u the drive in cells and Γ the Preisach model of [`crate::memory`],
//!
//! ```text
//! P = Γ[u] − (z − z₀)        dz = (a − β s z − γ |z|) du,  s = sign du          all in m; z₀ at rest
//! h = F(P)                   P = G(h), a polynomial that rises over the travel
//! y = h + Σ w_j x_j          x_j ← x_j + g_j (h − x_j), as in [`crate::creep`]
//! ```
//! Bouc (1967) and Wen (1976), exponent 1. |z| ≤ a/(β + γ). If Γ is a straight line, this is a classic Bouc-Wen leg; if
//! a = 0, a table with read-out and creep.
//!
//! The inverse needs no iteration and no division:
//!
//! 1. h is the demand without the creep of the states, and P = G(h).
//! 2. z at the end of the tick is predicted with the last step of the drive.
//! 3. u = Γ⁻¹(P + z − z₀).
//!
//! The step of the drive hardly changes from tick to tick, so the prediction error of z is of second order: about 1 nm
//! at 20 Hz and 15 µm. It does not accumulate, because the forward model then integrates z over the actual step, with
//! the midpoint rule. The prediction is stable where the leg is monotone: where the slope of Γ exceeds that of z.
//!
//! # Example
//!
//! Γ is a line of 3 µm a cell. After a reversal z takes 1 µm a cell of it.
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
//! let mut leg = BoucWenMemory::<f64, 8, 0>::at_rest(-0.25);
//! let mut last = 0.0;
//! for step in 1..=100 {
//!     last = leg.apply(&table, f64::from(step) * 0.01);
//! }
//! // 3 µm, less the change of z: nearly from −1/4 to 1/4.
//! assert!((last - 2.51).abs() < 0.01);
//! // The drive for a little less displacement: after the reversal the leg moves by 3 − 1 µm a cell.
//! let drive = leg.solve(&table, last - 0.01);
//! assert!(drive < 1.0 && drive > 0.98);
//! ```

use crate::crc::Crc32;
use crate::creep::Creep;
use crate::everett::LastLine;
use crate::memory::{DriveMemory, HysteresisMemory, ReversalMemory};
use crate::plays::{PlayMemory, Plays};
use crate::real::{Real, saturate};
use crate::snapshot::LARGEST;

/// Number of coefficients of a read-out: powers 1 to 5.
pub const READ_OUT: usize = 5;

/// Parameters of a leg model in addition to its table, with `K` creep operators.
#[derive(Debug, Clone, Copy)]
pub struct BoucWen<T, const K: usize> {
    /// Creep of h.
    pub creep: Creep<T, K>,
    /// 1/(1 + Σ w_j g_j), the reciprocal of [`Creep::direct`].
    pub share: T,
    /// G: coefficients of h, h², …
    pub read_out: [T; READ_OUT],
    /// F: coefficients of the inverse, P, P², …
    pub inverse: [T; READ_OUT],
    /// Lowest and highest h at which G is used, m.
    pub travel: [T; 2],
    /// a: dz/du at z = 0, m per cell.
    pub slope: T,
    /// β + γ: dz/du = a − (β + γ) |z| while |z| grows; per cell.
    pub beta_plus_gamma: T,
    /// β − γ: dz/du = a + (β − γ) |z| while |z| falls; per cell.
    pub beta_minus_gamma: T,
    /// a/(β + γ): largest |z|, m.
    pub limit: T,
    /// z₀: z at rest, m.
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

    /// dz/du at `z` for a drive that moves in the direction of `step`, m per cell.
    #[inline(always)]
    fn rate(&self, z: T, step: T) -> T {
        let along = if step < T::ZERO { -z } else { z };
        self.slope - if along < T::ZERO { self.beta_minus_gamma } else { self.beta_plus_gamma } * along
    }
}

/// Everett function of one leg, with the other parameters of its model.
#[derive(Debug, Clone, Copy)]
pub struct BoucWenEverett<'a, T, G, const K: usize> {
    /// Everett function of Γ, the static part.
    pub still: G,
    /// All other parameters.
    pub around: &'a BoucWen<T, K>,
}

crate::state! { |words|
    /// Memory of Γ, Bouc-Wen state and creep states of one leg. Reset: at rest, drive 0 after negative saturation with z =
    /// `rest`, no creep left.
    pub struct LegModelMemory<T, M, K>[T: Real, M: DriveMemory<T>, const K: usize](memory: M, rest: T) {
        memory: M = memory, part;
        /// z: the Bouc-Wen state, m.
        z: T = rest, number(words.sizes().leg);
        /// Last step of the drive, cells.
        step: T = T::ZERO, number(LARGEST);
        /// x_j: creep states, m.
        states: [T; K] = [T::ZERO; K], numbers(words.sizes().leg);
        /// y at the end of the tick, m.
        displacement: T = T::ZERO, number(words.sizes().leg);
    }
}

/// That of a leg whose Γ is a table.
pub type BoucWenMemory<T, const CAP: usize, const K: usize> = LegModelMemory<T, ReversalMemory<T, CAP>, K>;

impl<T: Real, const CAP: usize, const K: usize> BoucWenMemory<T, CAP, K> {
    /// At rest, with z = `rest`, m.
    #[must_use]
    pub const fn at_rest(rest: T) -> Self {
        Self::new(ReversalMemory::new(), rest)
    }

    /// The state at a drive just reached from below, see [`ReversalMemory::risen`]. `still` is the displacement of the
    /// table, `displacement` that of the leg without creep; all in m.
    #[must_use]
    pub const fn risen(drive: T, still: T, z: T, displacement: T) -> Self {
        let mut memory = Self::new(ReversalMemory::risen(drive, still), z);
        memory.displacement = displacement;
        memory
    }
}

/// That of a leg whose Γ is plays that widen with the rate.
pub type WidenedMemory<T, const K: usize> = LegModelMemory<T, PlayMemory<T>, K>;

impl<T: Real, const K: usize> WidenedMemory<T, K> {
    /// At rest, with z = `rest`, m.
    #[must_use]
    pub const fn at_rest(plays: &Plays<T>, rest: T) -> Self {
        Self::new(PlayMemory::new(plays.thresholds), rest)
    }

    /// The state at a drive just reached from below, see [`PlayMemory::risen`], with z and the `displacement` of the leg
    /// without creep, m.
    #[must_use]
    pub const fn risen(plays: PlayMemory<T>, z: T, displacement: T) -> Self {
        let mut memory = Self::new(plays, z);
        memory.displacement = displacement;
        memory
    }
}

impl<T: Real, M: DriveMemory<T>, const K: usize> LegModelMemory<T, M, K> {
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
    pub fn apply<G>(&mut self, table: &BoucWenEverett<'_, T, G, K>, drive: T) -> T
    where
        M: HysteresisMemory<T, G>,
    {
        let before = self.memory.drive();
        self.memory.apply(&table.still, drive);
        self.advance(table, before);
        self.displacement
    }

    /// The drive (cells) with which the next tick ends at `displacement` (m, finite), as near as the table reaches.
    #[inline]
    #[must_use]
    pub fn solve<G>(&self, table: &BoucWenEverett<'_, T, G, K>, displacement: T) -> T
    where
        M: HysteresisMemory<T, G>,
    {
        self.memory.solve(&table.still, self.static_demand(table, displacement).0)
    }

    /// Whether the table reaches `displacement` (m) from the present state.
    #[inline]
    #[must_use]
    pub fn reaches<G>(&self, table: &BoucWenEverett<'_, T, G, K>, displacement: T) -> bool
    where
        M: HysteresisMemory<T, G>,
    {
        let (still, within) = self.static_demand(table, displacement);
        within && self.memory.reaches(&table.still, still)
    }

    /// As [`ReversalMemory::follow_within`].
    #[inline(always)]
    pub fn follow_within<G>(
        &mut self,
        table: &BoucWenEverett<'_, T, G, K>,
        displacement: T,
        permit: impl FnOnce(T) -> T,
    ) -> bool
    where
        M: HysteresisMemory<T, G>,
    {
        let before = self.memory.drive();
        let (still, within) = self.static_demand(table, displacement);
        let beyond = self.memory.follow_within(&table.still, still, permit);
        self.advance(table, before);
        beyond || !within
    }

    /// As [`ReversalMemory::track`].
    #[inline(always)]
    pub fn track<G>(
        &mut self,
        table: &BoucWenEverett<'_, T, G, K>,
        last: &mut LastLine<T>,
        displacement: T,
        permit: impl FnOnce(T) -> Option<T>,
    ) -> bool
    where
        M: HysteresisMemory<T, G>,
    {
        let before = self.memory.drive();
        let (still, within) = self.static_demand(table, displacement);
        let tracked = within && self.memory.track(&table.still, last, still, permit);
        if tracked {
            self.advance(table, before);
        }
        tracked
    }

    /// Output of Γ that gives `displacement` at the end of the next tick, m, not limited to the table; and whether it
    /// is within the range of the read-out.
    #[inline(always)]
    fn static_demand<G>(&self, table: &BoucWenEverett<'_, T, G, K>, displacement: T) -> (T, bool) {
        let around = table.around;
        let demand = around.creep.without_carried(&self.states, displacement) * around.share;
        let h = saturate(demand, around.travel[0], around.travel[1]);
        let predicted = self.z + self.step * around.rate(self.z, self.step);
        (polynomial(&around.read_out, h) + (predicted - around.rest), h == demand)
    }

    /// Updates z, creep and displacement after a step of the drive from `before` to the present one.
    #[inline(always)]
    fn advance<G>(&mut self, table: &BoucWenEverett<'_, T, G, K>, before: T) {
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
