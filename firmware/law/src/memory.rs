//! Hysteresis models of a leg.

use core::fmt::Debug;

use specgen_runtime::{
    BoucWenEverett, CreepEverett, CreepMemory, DynamicEverett, DynamicMemory, Grid, HysteresisMemory, LastLine,
    LegModelMemory, Real, ReversalMemory, Snapshot,
};

/// Memory of a leg's drive; forward model and inverse over a table.
pub trait LegMemory<T: Real, Table>: Copy + Debug + Snapshot {
    /// Displacement that the model gives for the drive last applied, m.
    fn displacement(&self) -> T;
    /// Whether the last inverse was the static one because the rate-dependent model could not be inverted safely.
    #[inline(always)]
    fn fell_back(&self) -> bool {
        false
    }
    /// Whether the table reaches `displacement`, m.
    fn reaches(&self, table: &Table, displacement: T) -> bool;
    /// Applies a drive, cells; returns the displacement, m.
    fn apply(&mut self, table: &Table, drive: T) -> T;
    /// The drive for a displacement, m.
    fn solve(&mut self, table: &Table, displacement: T) -> T;
    /// Applies the drive for a displacement that needs no search, if `permit` allows it. Returns whether it did.
    #[inline(always)]
    fn track(
        &mut self,
        _table: &Table,
        _last: &mut LastLine<T>,
        _displacement: T,
        _permit: impl FnOnce(T) -> Option<T>,
    ) -> bool {
        false
    }
    /// Applies the drive that comes as near to a displacement as `permit` allows. Returns whether the displacement
    /// is out of the table's range.
    #[inline(always)]
    fn follow_within(&mut self, table: &Table, displacement: T, permit: impl FnOnce(T) -> T) -> bool {
        let within = self.reaches(table, displacement);
        let drive = permit(self.solve(table, displacement));
        self.apply(table, drive);
        !within
    }
}

macro_rules! leg_memory {
    ($([$($declared:tt)+] $table:ty, $memory:ty { $($own:tt)* })+) => {
        $(
            impl<$($declared)+> LegMemory<T, $table> for $memory {
                #[inline(always)]
                fn displacement(&self) -> T {
                    self.displacement()
                }
                #[inline(always)]
                fn reaches(&self, table: &$table, displacement: T) -> bool {
                    self.reaches(table, displacement)
                }
                #[inline(always)]
                fn apply(&mut self, table: &$table, drive: T) -> T {
                    self.apply(table, drive)
                }
                #[inline(always)]
                fn solve(&mut self, table: &$table, displacement: T) -> T {
                    Self::solve(self, table, displacement)
                }
                $($own)*
            }
        )+
    };
}

leg_memory! {
    [T: Real + Debug, G: Grid<T>, const CAP: usize] G, ReversalMemory<T, CAP> {
        #[inline(always)]
        fn track(
            &mut self,
            table: &G,
            last: &mut LastLine<T>,
            displacement: T,
            permit: impl FnOnce(T) -> Option<T>,
        ) -> bool {
            self.track(table, last, displacement, permit)
        }
        #[inline(always)]
        fn follow_within(&mut self, table: &G, displacement: T, permit: impl FnOnce(T) -> T) -> bool {
            self.follow_within(table, displacement, permit)
        }
    }
    [T: Real + Debug, G: Grid<T>, const CAP: usize] DynamicEverett<T, G>, DynamicMemory<T, CAP> {
        #[inline(always)]
        fn fell_back(&self) -> bool {
            self.fell_back()
        }
    }
    ['a, T: Real + Debug, G, M: HysteresisMemory<T, G> + Debug, const K: usize]
        BoucWenEverett<'a, T, G, K>, LegModelMemory<T, M, K>
    {
        #[inline(always)]
        fn track(
            &mut self,
            table: &BoucWenEverett<'a, T, G, K>,
            last: &mut LastLine<T>,
            displacement: T,
            permit: impl FnOnce(T) -> Option<T>,
        ) -> bool {
            self.track(table, last, displacement, permit)
        }
        #[inline(always)]
        fn follow_within(
            &mut self,
            table: &BoucWenEverett<'a, T, G, K>,
            displacement: T,
            permit: impl FnOnce(T) -> T,
        ) -> bool {
            self.follow_within(table, displacement, permit)
        }
    }
    ['a, T: Real + Debug, G: Grid<T>, const CAP: usize, const K: usize] CreepEverett<'a, T, G, K>, CreepMemory<T, CAP, K> {}
}
