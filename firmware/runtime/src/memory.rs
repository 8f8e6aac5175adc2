//! Reversal memory: the Preisach model online, forward and inverse, in bounded memory.
//!
//! The state of a Preisach model is the staircase of past extrema that later drives have not wiped out: minima
//! p₀ < p₂ < … and maxima p₁ > p₃ > …, where p₀ is negative saturation. f_k is the displacement at p_k.
//!
//! ```text
//! rising  from a minimum p_k:  f(x) = f_k + E(x, p_k)     until x ≥ p_{k−1}, which wipes p_{k−1} and p_k out
//! falling from a maximum p_k:  f(x) = f_k − E(p_k, x)     until x ≤ p_{k−1}, likewise
//! ```
//! The inverse follows the same staircase by displacement, then solves one branch ([`Grid::rise`], [`Grid::fall`]).
//! Within a cell of the table a branch is a straight line ([`Line`]), which inverse and forward model share.
//!
//! The table sets the number of stored extrema ([`Grid::capacity`]): the memory's size, or fewer.
//!
//! # Example
//!
//! With the table of [`crate::everett`]: a drive of 1 cell gives 2 µm on the way up and 3 µm on the way down.
//!
//! ```
//! use specgen_runtime::{Everett, ReversalMemory};
//!
//! let table = Everett::<f64, 2, 6> { nodes: &[0.0, 2.0, 0.0, 6.0, 3.0, 0.0] };
//! let mut leg = ReversalMemory::<f64, 8>::new();
//! assert_eq!(leg.apply(&table, 1.0), 2.0);
//! assert_eq!(leg.apply(&table, 2.0), 6.0);
//! assert_eq!(leg.apply(&table, 1.0), 3.0); // 6 − E(2, 1)
//! // Γ⁻¹ on the rise from this reversal: 3 + 3 (x − 1) = 4.5
//! assert_eq!(leg.solve(&table, 4.5), 1.5);
//! assert_eq!(leg.apply(&table, 1.5), 4.5);
//! assert_eq!(leg.depth(), 3); // negative saturation, the maximum at 2, the minimum at 1
//! // The minor loop closes where it began, and is wiped out.
//! assert_eq!(leg.apply(&table, 2.0), 6.0);
//! assert_eq!(leg.depth(), 1);
//! ```

use crate::everett::{Grid, LastLine, Line};
use crate::real::{Real, saturate};
use crate::snapshot::{LARGEST, Snapshot};

crate::state! { |words|
    /// Staircase of at most `CAP` ≥ 4 extrema. Drives in cells of the Everett grid, displacements in m.
    ///
    /// Reset state: drive 0 after negative saturation, displacement 0. A real leg reaches it by a sweep to the upper
    /// voltage limit and back.
    pub struct ReversalMemory<T, CAP>[T: Real, const CAP: usize] {
        /// Number of stored extrema, 1..=CAP. A snapshot has zeros for the others.
        len: usize = { let () = Self::FITS; 1 }, place(words.sizes().kept(CAP)) if *len > 0;
        /// Pairs dropped because the memory was full.
        dropped: u32 = 0, tally;
        drive: T = T::ZERO, number(LARGEST);
        displacement: T = T::ZERO, number(words.sizes().leg);
        /// p_k; even k are minima, odd k maxima; p₀ = 0.
        extrema: [T; CAP] = [T::ZERO; CAP], stored(*len, LARGEST)
            if is_staircase(extrema.get(..*len).unwrap_or_default(), *drive, T::from_f64(words.sizes().grid));
        /// f_k.
        displacements: [T; CAP] = [T::ZERO; CAP], stored(*len, words.sizes().leg);
    }
}

/// Whether minima rise and maxima fall from at most `grid`, all nested, the first at negative saturation, and the drive
/// is within the innermost.
fn is_staircase<T: Real>(extrema: &[T], drive: T, grid: T) -> bool {
    let mut low = T::ZERO;
    let mut high = grid;
    let mut nested = extrema.first() == Some(&T::ZERO);
    for (k, extremum) in extrema.iter().enumerate() {
        nested &= low <= *extremum && *extremum <= high;
        if k % 2 == 0 { low = *extremum } else { high = *extremum }
    }
    nested && low <= drive && drive <= high
}

/// Start of a branch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Origin<T> {
    /// Index of the extremum there; [`ReversalMemory::depth`] if it is the present point, which would become one.
    pub(crate) top: usize,
    /// Drive there, cells.
    pub(crate) start: T,
    /// Displacement there, m.
    pub(crate) at_start: T,
}

/// The branch of a solution. It is kept so that applying the drive does not look the table up again.
#[derive(Clone, Copy)]
struct Branch<T> {
    /// As [`Origin::top`].
    top: usize,
    /// Displacement at its start, m.
    at_start: T,
    /// Its segment in the cell of the solution.
    line: Line<T>,
}

/// What a model with a reversal memory shows of its last tick: methods of its `impl`.
macro_rules! present_point {
    () => {
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
    };
}
pub(crate) use present_point;

/// Memory of a leg's drive.
pub trait DriveMemory<T: Real>: Snapshot + Copy {
    /// The drive last applied, cells.
    fn drive(&self) -> T;
    /// The displacement that the model gives for it, m.
    fn displacement(&self) -> T;
}

/// Forward model and inverse of a leg with the parameters in a `Table`: methods as those of [`ReversalMemory`].
pub trait HysteresisMemory<T: Real, Table>: DriveMemory<T> {
    /// As [`ReversalMemory::apply`].
    fn apply(&mut self, table: &Table, drive: T) -> T;
    /// As [`ReversalMemory::solve`].
    fn solve(&self, table: &Table, displacement: T) -> T;
    /// As [`ReversalMemory::reaches`].
    fn reaches(&self, table: &Table, displacement: T) -> bool;
    /// As [`ReversalMemory::follow_within`].
    fn follow_within(&mut self, table: &Table, displacement: T, permit: impl FnOnce(T) -> T) -> bool;
    /// As [`ReversalMemory::track`]; false if there is no faster path.
    fn track(
        &mut self,
        table: &Table,
        last: &mut LastLine<T>,
        displacement: T,
        permit: impl FnOnce(T) -> Option<T>,
    ) -> bool;
}

impl<T: Real, const CAP: usize> DriveMemory<T> for ReversalMemory<T, CAP> {
    #[inline(always)]
    fn drive(&self) -> T {
        self.drive
    }
    #[inline(always)]
    fn displacement(&self) -> T {
        self.displacement
    }
}

impl<T: Real, G: Grid<T>, const CAP: usize> HysteresisMemory<T, G> for ReversalMemory<T, CAP> {
    #[inline(always)]
    fn apply(&mut self, table: &G, drive: T) -> T {
        self.apply(table, drive)
    }
    #[inline(always)]
    fn solve(&self, table: &G, displacement: T) -> T {
        self.solve(table, displacement)
    }
    #[inline(always)]
    fn reaches(&self, table: &G, displacement: T) -> bool {
        self.reaches(table, displacement)
    }
    #[inline(always)]
    fn follow_within(&mut self, table: &G, displacement: T, permit: impl FnOnce(T) -> T) -> bool {
        self.follow_within(table, displacement, permit)
    }
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
}

impl<T: Real, const CAP: usize> ReversalMemory<T, CAP> {
    /// Evaluated by `new`, so that a smaller `CAP` does not compile.
    const FITS: () = assert!(CAP >= 4, "a reversal memory needs room for a loop within a loop");

    /// The state after a rise from negative saturation to `drive` (cells, 0..=N), where the model gives `displacement`
    /// = E(`drive`, 0), m.
    #[must_use]
    pub const fn risen(drive: T, displacement: T) -> Self {
        let mut memory = Self::new();
        memory.drive = drive;
        memory.displacement = displacement;
        memory
    }

    /// The drive last applied, cells.
    #[inline]
    #[must_use]
    pub fn drive(&self) -> T {
        self.drive
    }

    /// The displacement that the model gives for the drive last applied, m.
    #[inline]
    #[must_use]
    pub fn displacement(&self) -> T {
        self.displacement
    }

    /// Number of extrema in memory, 1..=CAP.
    #[must_use]
    pub fn depth(&self) -> usize {
        self.len
    }

    /// Pairs of extrema dropped since reset because the memory was full.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Γ: applies `drive` (cells, limited to 0..=N) and returns the displacement, m.
    ///
    /// `drive` must be finite.
    #[inline]
    pub fn apply<G: Grid<T>>(&mut self, table: &G, drive: T) -> T {
        let drive = saturate(drive, T::ZERO, table.full_scale());
        if drive == self.drive {
            return self.displacement;
        }
        let rising = drive > self.drive;
        if rising != self.is_rising() {
            self.push(table);
        }
        self.displacement = if rising {
            // A pair ends with its maximum, p₁ or later.
            while self.len >= 3 && drive >= self.extremum(self.len - 2) {
                self.len -= 2;
            }
            let top = self.len - 1;
            let line = table.rising(self.extremum(top), table.cell(drive));
            self.displacement_at(top) + line.at::<true>(drive)
        } else {
            // p₀ belongs to no pair; reaching it is handled below.
            while self.len >= 4 && drive <= self.extremum(self.len - 2) {
                self.len -= 2;
            }
            let top = self.len - 1;
            if drive <= T::ZERO {
                self.len = 1;
                T::ZERO
            } else {
                let line = table.falling(self.extremum(top), table.cell(drive));
                self.displacement_at(top) - line.at::<false>(drive)
            }
        };
        self.drive = drive;
        self.displacement
    }

    /// Γ⁻¹: the drive (cells) that [`ReversalMemory::apply`] would turn into `displacement` (m, limited to the range of
    /// the table). Does not change the memory.
    ///
    /// `displacement` must be finite.
    #[inline]
    #[must_use]
    pub fn solve<G: Grid<T>>(&self, table: &G, displacement: T) -> T {
        let target = table.within_reach(displacement);
        if target == self.displacement {
            return self.drive;
        }
        if target > self.displacement {
            self.solve_branch::<true, G>(table, target).0
        } else {
            self.solve_branch::<false, G>(table, target).0
        }
    }

    /// Whether the table reaches `displacement` (m).
    #[inline]
    #[must_use]
    pub fn reaches<G: Grid<T>>(&self, table: &G, displacement: T) -> bool {
        displacement >= T::ZERO && displacement <= table.full_displacement()
    }

    /// [`ReversalMemory::follow`] for a displacement (m, finite) that may be out of the table's range. Returns whether
    /// it was.
    #[inline(always)]
    pub fn follow_within<G: Grid<T>>(&mut self, table: &G, displacement: T, permit: impl FnOnce(T) -> T) -> bool {
        let reached = self.reaches(table, displacement);
        self.follow(table, if reached { displacement } else { table.within_reach(displacement) }, permit);
        !reached
    }

    /// The fast path of [`ReversalMemory::follow_within`], without a search. It applies if the table reaches
    /// `displacement` (m, finite), the solution lies in the cell of the present drive, and `permit` leaves it there.
    /// Returns whether it applies; if not, nothing has changed. `last` must belong to this table.
    #[inline(always)]
    pub fn track<G: Grid<T>>(
        &mut self,
        table: &G,
        last: &mut LastLine<T>,
        displacement: T,
        permit: impl FnOnce(T) -> Option<T>,
    ) -> bool {
        if !self.reaches(table, displacement) {
            return false;
        }
        let cell = table.cell(self.drive);
        if displacement > self.displacement {
            let (start, at_start, top) = self.branch_start::<true>(displacement);
            let branch = Branch { top, at_start, line: last.of::<true, G>(table, start, cell) };
            match branch.line.within::<true>(displacement - at_start) {
                Some(drive) => {
                    permit(drive).is_some_and(|drive| self.apply_near_segment::<true, G>(table, &branch, drive))
                }
                None => false,
            }
        } else if displacement < self.displacement {
            let (start, at_start, top) = self.branch_start::<false>(displacement);
            let branch = Branch { top, at_start, line: last.of::<false, G>(table, start, cell) };
            match branch.line.within::<false>(at_start - displacement) {
                Some(drive) => {
                    permit(drive).is_some_and(|drive| self.apply_near_segment::<false, G>(table, &branch, drive))
                }
                None => false,
            }
        } else {
            false
        }
    }

    /// Γ⁻¹ and Γ in one: solves for `displacement`, which must be within the range of the table, and applies the drive
    /// (finite) to which `permit` limits and rounds the solution. `permit` is called once.
    ///
    /// Bit-identical to [`ReversalMemory::solve`] followed by [`ReversalMemory::apply`], but faster: a permitted drive
    /// usually lies on the same segment of the branch as the solution, and then nothing is looked up twice.
    #[inline(always)]
    pub fn follow<G: Grid<T>>(&mut self, table: &G, displacement: T, permit: impl FnOnce(T) -> T) {
        let drive = if displacement > self.displacement {
            let (solution, branch) = self.solve_branch::<true, G>(table, displacement);
            let drive = permit(solution);
            if self.apply_on_segment::<true, G>(table, &branch, drive) {
                return;
            }
            drive
        } else if displacement < self.displacement {
            let (solution, branch) = self.solve_branch::<false, G>(table, displacement);
            let drive = permit(solution);
            if self.apply_on_segment::<false, G>(table, &branch, drive) {
                return;
            }
            drive
        } else {
            permit(self.drive)
        };
        self.apply(table, drive);
    }

    /// Applies a drive that usually lies on the segment of a branch. Always returns true.
    #[inline(always)]
    fn apply_near_segment<const RISING: bool, G: Grid<T>>(&mut self, table: &G, branch: &Branch<T>, drive: T) -> bool {
        if !self.apply_on_segment::<RISING, G>(table, branch, drive) {
            self.apply_anew(table, drive);
        }
        true
    }

    /// [`ReversalMemory::apply`], not inlined.
    #[cold]
    #[inline(never)]
    fn apply_anew<G: Grid<T>>(&mut self, table: &G, drive: T) {
        self.apply(table, drive);
    }

    /// Applies a drive if it lies on the segment of a branch and wipes out the same extrema as the solution. Returns
    /// whether it is now applied; if not, nothing has changed.
    #[inline(always)]
    fn apply_on_segment<const RISING: bool, G: Grid<T>>(&mut self, table: &G, branch: &Branch<T>, drive: T) -> bool {
        let Branch { top, at_start, line } = *branch;
        let onward = if RISING { drive > self.drive } else { drive < self.drive };
        // Nothing to apply if the drive stays. If the memory is full, a new extremum may drop another: not here.
        if !onward || !line.holds(drive) || self.len >= table.capacity(CAP) {
            return drive == self.drive;
        }
        // The drive must leave the loops that the solution leaves. It does if it leaves the outermost of them.
        if top + 1 < self.len {
            let inner = self.extremum(top + 1);
            let falls_short = if RISING { drive < inner } else { drive > inner };
            if falls_short {
                return false;
            }
        }
        // It must not leave more loops. A fall from the first maximum p₁ can: at p₀ it wipes out everything.
        if top >= if RISING { 2 } else { 1 } {
            let bound = self.extremum(top - 1);
            let goes_beyond = if RISING { drive >= bound } else { drive <= bound };
            if goes_beyond {
                return false;
            }
        }
        if top == self.len {
            let k = Self::bounded(top);
            self.extrema[k] = self.drive;
            self.displacements[k] = self.displacement;
        }
        self.len = top + 1;
        self.drive = drive;
        let moved = line.at::<RISING>(drive);
        self.displacement = if RISING { at_start + moved } else { at_start - moved };
        true
    }

    /// Start of the branch to a displacement above the present one (`RISING`), or below it: drive, displacement and
    /// [`Origin::top`]. Like [`ReversalMemory::origin`], but for a displacement.
    #[inline(always)]
    fn branch_start<const RISING: bool>(&self, target: T) -> (T, T, usize) {
        // The branch starts at the last extremum if the direction is unchanged, else at the present drive.
        let (mut start, mut at_start, mut top) = if RISING == self.is_rising() {
            let top = self.len - 1;
            (self.extremum(top), self.displacement_at(top), top)
        } else {
            (self.drive, self.displacement, self.len)
        };
        // Walk outwards: a target beyond the loop of a pair of extrema wipes the pair out.
        while top >= 2 {
            let bound = self.displacement_at(top - 1);
            let leaves = if RISING { target >= bound } else { target <= bound };
            if !leaves {
                break;
            }
            top -= 2;
            start = self.extremum(top);
            at_start = self.displacement_at(top);
        }
        (start, at_start, top)
    }

    /// The drive for a displacement above the present one (`RISING`), or below it, and the branch that leads there.
    #[inline(always)]
    fn solve_branch<const RISING: bool, G: Grid<T>>(&self, table: &G, target: T) -> (T, Branch<T>) {
        let (start, at_start, top) = self.branch_start::<RISING>(target);
        let (drive, line) = if RISING {
            table.rise(start, self.drive, target - at_start)
        } else {
            table.fall(start, self.drive, at_start - target)
        };
        (drive, Branch { top, at_start, line })
    }

    /// Start of the branch on which [`ReversalMemory::apply`] of `drive` would end. Does not change the memory.
    #[inline]
    pub(crate) fn origin(&self, drive: T) -> Origin<T> {
        let rising = drive > self.drive;
        let (mut start, mut at_start, mut top) = if rising == self.is_rising() {
            let top = self.len - 1;
            (self.extremum(top), self.displacement_at(top), top)
        } else {
            (self.drive, self.displacement, self.len)
        };
        while top >= 2 {
            let bound = self.extremum(top - 1);
            let wiped_out = if rising { drive >= bound } else { drive <= bound };
            if !wiped_out {
                break;
            }
            top -= 2;
            start = self.extremum(top);
            at_start = self.displacement_at(top);
        }
        Origin { top, start, at_start }
    }

    /// Whether the branch since the last extremum rises (it left a minimum).
    #[inline]
    fn is_rising(&self) -> bool {
        self.len % 2 == 1
    }

    /// p_k, cells.
    #[inline]
    pub(crate) fn extremum(&self, k: usize) -> T {
        self.extrema[Self::bounded(k)]
    }

    /// f_k, m.
    #[inline]
    fn displacement_at(&self, k: usize) -> T {
        self.displacements[Self::bounded(k)]
    }

    /// `k`, which is always below CAP. This form shows it to the compiler, which then adds no check that could panic.
    #[inline(always)]
    const fn bounded(k: usize) -> usize {
        if CAP.is_power_of_two() {
            k & (CAP - 1)
        } else if k < CAP {
            k
        } else {
            CAP - 1
        }
    }

    /// Makes the present point the newest extremum.
    #[inline]
    fn push<G: Grid<T>>(&mut self, table: &G) {
        let capacity = table.capacity(CAP);
        if self.len >= capacity {
            self.drop_least(table);
        }
        let k = Self::bounded(if self.len < capacity { self.len } else { capacity - 1 });
        self.extrema[k] = self.drive;
        self.displacements[k] = self.displacement;
        self.len = k + 1;
    }

    /// Drops the pair of neighbouring extrema with the smallest effect.
    ///
    /// Without p_i and p_{i+1}, every later displacement changes by the Everett rectangle of the four neighbours, w_i =
    /// E(p_{i−1}, p_i) − E(p_i, p_{i+1}) + E(p_{i+1}, p_{i+2}) − E(p_{i−1}, p_{i+2}) in absolute value, with the larger argument
    /// of each E as its first. The pair with
    /// the smallest w is dropped; p₀ stays. Dropping the innermost loop instead gave errors up to 3.9 µm. Three of the
    /// four terms are differences of stored displacements.
    #[cold]
    #[inline(never)]
    fn drop_least<G: Grid<T>>(&mut self, table: &G) {
        let capacity = table.capacity(CAP);
        let mut least = T::ZERO;
        let mut shift = T::ZERO;
        let mut at = 0;
        for i in 1..capacity - 1 {
            let (outer, at_outer) = (self.extremum(i - 1), self.displacement_at(i - 1));
            let (inner, at_inner) = if i + 2 < capacity {
                (self.extremum(i + 2), self.displacement_at(i + 2))
            } else {
                (self.drive, self.displacement)
            };
            let direct =
                if outer < inner { at_outer + table.value(inner, outer) } else { at_outer - table.value(outer, inner) };
            let change = direct - at_inner;
            if at == 0 || change.abs() < least {
                (least, shift, at) = (change.abs(), change, i);
            }
        }
        for k in 1..capacity - 2 {
            if k >= at {
                self.extrema[Self::bounded(k)] = self.extremum(k + 2);
                self.displacements[Self::bounded(k)] = self.displacement_at(k + 2) + shift;
            }
        }
        self.displacement = self.displacement + shift;
        self.len = capacity - 2;
        self.dropped = self.dropped.saturating_add(1);
    }
}
