//! Six equilibrium equations for six leg forces, solved in a fixed order.

use super::LEGS;
use crate::real::Real;

/// A leg's contribution.
pub(super) struct Share<T, const E: usize> {
    /// Its column of the equilibrium equations: s, and the moment of s about the pole.
    pub column: [T; 6],
    /// Part that goes straight into its force, N.
    pub axial: T,
    /// Δl, m, if requested.
    pub displacement: [T; E],
}

/// Equilibrium of the legs.
pub(super) struct Balance<T, const E: usize> {
    /// The legs in the order of elimination.
    pub shares: [Share<T, E>; LEGS],
    /// Remaining force, and moment about the pole.
    pub wrench: [T; 6],
}

/// A column after elimination, equations in their fixed order: above and on the diagonal U, below it L.
struct Column<T> {
    entries: [T; 6],
    inverse_pivot: T,
}

impl<T: Real, const E: usize> Balance<T, E> {
    /// Leg forces, N, each with its own axial part.
    #[inline(always)]
    pub fn forces(&self, rows: &[usize; 6]) -> [T; LEGS] {
        let factors = self.factors(rows);
        let [a, b, c, d, e, f] = &factors;
        let mut force = ordered(&self.wrench, rows);
        eliminate(&mut force, [a, b, c, d, e, f], rows);
        for (k, column) in factors.iter().enumerate().rev() {
            force[k] = force[k] * column.inverse_pivot;
            for i in 0..LEGS {
                if i < k {
                    force[i] = force[i] - column.entries[i] * force[k];
                }
            }
        }
        for (force, share) in force.iter_mut().zip(&self.shares) {
            *force = *force + share.axial;
        }
        force
    }

    /// The divisors of the elimination.
    pub fn pivots(&self, rows: &[usize; 6]) -> [T; LEGS] {
        let [a, b, c, d, e, f] = self.factors(rows);
        [a.entries[0], b.entries[1], c.entries[2], d.entries[3], e.entries[4], f.entries[5]]
    }

    /// Δl of each leg, m, if requested.
    #[inline(always)]
    pub fn displacements(&self) -> [T; LEGS] {
        let [a, b, c, d, e, f] = &self.shares;
        [a, b, c, d, e, f].map(|share| share.displacement.first().copied().unwrap_or(T::ZERO))
    }

    /// LU factors, column by column: one at a time fits into a microcontroller's registers.
    #[inline(always)]
    fn factors(&self, rows: &[usize; 6]) -> [Column<T>; LEGS] {
        let [sa, sb, sc, sd, se, sf] = &self.shares;
        let a = factor(sa, [], rows);
        let b = factor(sb, [&a], rows);
        let c = factor(sc, [&a, &b], rows);
        let d = factor(sd, [&a, &b, &c], rows);
        let e = factor(se, [&a, &b, &c, &d], rows);
        let f = factor(sf, [&a, &b, &c, &d, &e], rows);
        [a, b, c, d, e, f]
    }
}

/// The column of the leg at place `J`, after those before it.
#[inline(always)]
fn factor<T: Real, const E: usize, const J: usize>(
    share: &Share<T, E>,
    before: [&Column<T>; J],
    rows: &[usize; 6],
) -> Column<T> {
    let mut entries = ordered(&share.column, rows);
    eliminate(&mut entries, before, rows);
    let inverse_pivot = T::ONE / entries[J % 6];
    for (i, entry) in entries.iter_mut().enumerate() {
        if i > J {
            *entry = *entry * inverse_pivot;
        }
    }
    Column { entries, inverse_pivot }
}

/// Subtracts from `values` the part of the legs before.
#[inline(always)]
fn eliminate<T: Real, const J: usize>(values: &mut [T; 6], before: [&Column<T>; J], rows: &[usize; 6]) {
    for k in 0..J {
        for i in 0..6 {
            // The first leg has no moment about the pole.
            if i > k && (k > 0 || rows[i] < 3) {
                values[i] = values[i] - before[k].entries[i] * values[k % 6];
            }
        }
    }
}

/// Values in the order of the equations. The bound shows the compiler that there is no panic path.
#[inline(always)]
fn ordered<T: Real>(values: &[T; 6], rows: &[usize; 6]) -> [T; 6] {
    rows.map(|row| values[if row < 6 { row } else { 0 }])
}
