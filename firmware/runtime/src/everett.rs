//! The Everett function on a grid.
//!
//! E(up, down) is the displacement that a rise of the drive from `down` to `up` adds if it starts at a reversal, and
//! that the fall from `up` to `down` subtracts. First-order reversal curves measure it. It is the double integral of
//! the Preisach weight over the triangle down ≤ down' ≤ up' ≤ up.
//!
//! Drives are counted in *cells* above the lowest threshold: 0 ≤ x ≤ N. Between nodes E is bilinear in square cells
//! (uniform weight) and linear in the triangles on the diagonal (their weight is reversible).
//!
//! [`Grid`] has the algorithms. A table written by the compiler is an [`Everett`], whose size is part of its type; a
//! table read at run time is [`Nodes`]. Equal numbers give equal bits in both.
//!
//! # Example
//!
//! A table of two cells, in µm. Rising from 0, the leg moves 2 µm in the first cell and 4 µm in the second; rising from
//! a reversal at 1 cell, only 3 µm:
//!
//! ```
//! use specgen_runtime::{Everett, Grid};
//!
//! //             E(0, 0)  E(1, 0) E(1, 1)  E(2, 0) E(2, 1) E(2, 2)
//! let nodes = &[0.0,     2.0, 0.0,        6.0, 3.0, 0.0];
//! let table = Everett::<f64, 2, 6> { nodes };
//! assert_eq!(table.value(1.5, 0.0), 4.0); // 2 + 4/2
//! assert_eq!(table.value(1.5, 1.0), 1.5); // 3/2
//! // The inverse: from 0, a displacement of 4 µm needs 1.5 cells.
//! assert_eq!(table.rise(0.0, 0.0, 4.0).0, 1.5);
//! // From full drive, a fall to 1 cell takes 3 µm away.
//! assert_eq!(table.fall(2.0, 2.0, 3.0).0, 1.0);
//! ```

use crate::field::Field;
use crate::real::{Real, saturate};

/// Everett function of one leg: `N` × `N` cells, `NODES` = (N+1)(N+2)/2 nodes.
///
/// `nodes` holds E(i, j) for `up` threshold i = 0..=N and, in each row, `down` threshold j = 0..=i, so that
/// E(i, j) is at i(i+1)/2 + j and the diagonal E(i, i) is zero. Metres. Values rise with i and fall with j.
#[derive(Debug, Clone, Copy)]
pub struct Everett<T: 'static, const N: usize, const NODES: usize> {
    /// See the type.
    pub nodes: &'static [T; NODES],
}

/// A segment of a branch within one cell, where E is linear in the drive x: E = `base` + `slope` |x − `origin`|.
#[derive(Debug, Clone, Copy)]
pub struct Line<T> {
    cell: usize,
    origin: T,
    base: T,
    slope: T,
}

impl<T: Real> Line<T> {
    /// For a branch that has reached the end of the table: no drive lies on it.
    const END: Self = Self { cell: usize::MAX, origin: T::ZERO, base: T::ZERO, slope: T::ZERO };

    /// E at a drive in the cell, above the origin on a rising branch, below it on a falling one; m.
    #[inline(always)]
    #[must_use]
    pub fn at<const RISING: bool>(&self, drive: T) -> T {
        self.base + self.slope * if RISING { drive - self.origin } else { self.origin - drive }
    }

    /// Whether a drive ≥ 0 lies in the cell.
    #[inline(always)]
    #[must_use]
    pub fn holds(&self, drive: T) -> bool {
        drive.truncate() as usize == self.cell
    }

    /// The drive where E is `value`, if it is in the cell and the segment is not flat.
    #[inline(always)]
    pub(crate) fn within<const RISING: bool>(&self, value: T) -> Option<T> {
        let drive = self.solve::<RISING>(value);
        (self.slope > T::ZERO && self.holds(drive)).then_some(drive)
    }

    /// The drive where E is `value`; the origin if the segment is flat.
    #[inline(always)]
    fn solve<const RISING: bool>(&self, value: T) -> T {
        let length = if self.slope > T::ZERO { (value - self.base) / self.slope } else { T::ZERO };
        if RISING { self.origin + length } else { self.origin - length }
    }
}

/// The segment of the last solution. A leg that tracks within it, as in most ticks, needs no look-up.
///
/// Its content follows from its key and the table, which must be the same each time. So it is not part of the state:
/// whether it is empty or old changes no bit.
#[derive(Debug, Clone, Copy)]
pub struct LastLine<T> {
    /// Start of the branch, and whether it rises.
    start: T,
    rising: bool,
    line: Line<T>,
}

impl<T: Real> LastLine<T> {
    /// Of none.
    #[must_use]
    pub const fn new() -> Self {
        Self { start: T::ZERO, rising: false, line: Line::END }
    }

    /// [`Grid::rising`] or [`Grid::falling`] from `start` within `cell`.
    #[inline(always)]
    pub(crate) fn of<const RISING: bool, G: Grid<T>>(&mut self, table: &G, start: T, cell: usize) -> Line<T> {
        if self.line.cell == cell && self.start == start && self.rising == RISING {
            return self.line;
        }
        let line = if RISING { table.rising(start, cell) } else { table.falling(start, cell) };
        // Within its first cell, a branch is found faster than it is stored.
        if table.cell(start) != cell {
            *self = Self { start, rising: RISING, line };
        }
        line
    }
}

impl<T: Real> Default for LastLine<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Field for LastLine<T> {
    const WORDS: usize = 0;
}

/// A table of the Everett function of one leg: N × N cells.
pub trait Grid<T: Real>: Sized {
    /// N ≥ 1.
    fn cells(&self) -> usize;

    /// Number of extrema that a reversal memory with room for `room` stores on this table: 4 to `room`.
    #[inline(always)]
    fn capacity(&self, room: usize) -> usize {
        room
    }

    /// E at the nodes `up` and `down`, `down` ≤ `up` ≤ N.
    fn node(&self, up: usize, down: usize) -> T;

    /// E over a diagonal cell: that at `up` node `cell` + 1 and `down` node `cell`.
    fn diagonal(&self, cell: usize) -> T;

    /// The nodes around a cell off the diagonal: those at its lower `up` threshold and those at its upper one, each
    /// starting at the lower `down` threshold.
    fn corners(&self, up: usize, down: usize) -> [[T; 2]; 2];

    /// The cell of a drive, 0..N; full drive is in the last.
    #[inline]
    fn cell(&self, drive: T) -> usize {
        let whole = drive.truncate();
        let last = self.cells() as i32 - 1;
        let whole = if whole > last { last } else { whole };
        let whole = if whole < 0 { 0 } else { whole };
        whole as usize
    }

    /// Largest drive, N cells.
    #[inline]
    #[must_use]
    fn full_scale(&self) -> T {
        T::from_i32(self.cells() as i32)
    }

    /// Displacement at full drive after saturation, E(N, 0), m.
    #[inline]
    #[must_use]
    fn full_displacement(&self) -> T {
        self.node(self.cells(), 0)
    }

    /// A displacement limited to 0..=E(N, 0), m.
    #[inline]
    #[must_use]
    fn within_reach(&self, displacement: T) -> T {
        saturate(displacement, T::ZERO, self.full_displacement())
    }

    /// E(`up`, `down`) in m, for 0 ≤ `down` ≤ `up` ≤ N cells.
    #[inline]
    #[must_use]
    fn value(&self, up: T, down: T) -> T {
        self.rising(down, self.cell(up)).at::<true>(up)
    }

    /// The branch that rises from a reversal at `down`, within `cell`, not below that of `down`: E(x, `down`).
    #[inline(always)]
    #[must_use]
    fn rising(&self, down: T, cell: usize) -> Line<T> {
        let d = Place::on(self, down);
        if cell == d.cell {
            return Line { cell, origin: down, base: T::ZERO, slope: self.diagonal(cell) };
        }
        let [below, above] = self.corners(cell, d.cell);
        let (low, high) = (between(below, d.part), between(above, d.part));
        Line { cell, origin: T::from_i32(cell as i32), base: low, slope: high - low }
    }

    /// The branch that falls from a reversal at `up`, within `cell`, not above that of `up`: E(`up`, x).
    #[inline(always)]
    #[must_use]
    fn falling(&self, up: T, cell: usize) -> Line<T> {
        let u = Place::on(self, up);
        if cell == u.cell {
            return Line { cell, origin: up, base: T::ZERO, slope: self.diagonal(cell) };
        }
        let [below, above] = self.corners(u.cell, cell);
        let (low, high) = (between([below[0], above[0]], u.part), between([below[1], above[1]], u.part));
        Line { cell, origin: T::from_i32(cell as i32 + 1), base: high, slope: low - high }
    }

    /// The drive above `down` at which a rise from `down` has added `gain` (m): solves E(x, `down`) = `gain`. Also
    /// returns the segment of the branch.
    ///
    /// `least` is a known lower bound of the solution, at least `down`. The search begins in its cell, where a tracking
    /// leg finds the solution. If full drive gives less than `gain`, the result is N. Where the table is flat, it is
    /// the smallest solution not below the cell of `least`.
    #[inline(always)]
    #[must_use]
    fn rise(&self, down: T, least: T, gain: T) -> (T, Line<T>) {
        let line = self.rising(down, self.cell(least));
        match line.within::<true>(gain) {
            Some(drive) => (drive, line),
            None => rise_beyond(self, down, line, gain),
        }
    }

    /// The drive below `up` at which a fall from `up` has subtracted `loss` (m): solves E(`up`, x) = `loss`. Also
    /// returns the segment of the branch.
    ///
    /// `most` is a known upper bound of the solution, at most `up`. The search begins in its cell. If zero drive
    /// subtracts less than `loss`, the result is 0. Where the table is flat, it is the largest solution not above the
    /// cell of `most`.
    #[inline(always)]
    #[must_use]
    fn fall(&self, up: T, most: T, loss: T) -> (T, Line<T>) {
        let line = self.falling(up, self.cell(most));
        match line.within::<false>(loss) {
            Some(drive) => (drive, line),
            None => fall_beyond(self, up, line, loss),
        }
    }
}

/// [`Grid::rise`] if the solution is not a drive within the cell of `first`: at the end of a segment, flat, or beyond.
#[cold]
#[inline(never)]
fn rise_beyond<T: Real, G: Grid<T>>(table: &G, down: T, first: Line<T>, gain: T) -> (T, Line<T>) {
    if gain - first.base <= first.slope * (T::from_i32(first.cell as i32 + 1) - first.origin) {
        return (first.solve::<true>(gain), first);
    }
    let d = Place::on(table, down);
    let (mut low, mut high) = (first.cell + 1, table.cells());
    let at_full = along_row(table, high, d);
    if gain >= at_full || low >= high {
        return (table.full_scale(), Line::END);
    }
    // The solution lies between these nodes.
    for _ in 0..search_steps(table) {
        if high - low <= 1 {
            break;
        }
        let middle = (low + high) / 2;
        if along_row(table, middle, d) < gain {
            low = middle;
        } else {
            high = middle;
        }
    }
    let line = table.rising(down, low);
    (line.solve::<true>(gain), line)
}

/// [`Grid::fall`] if the solution is not a drive within the cell of `first`.
#[cold]
#[inline(never)]
fn fall_beyond<T: Real, G: Grid<T>>(table: &G, up: T, first: Line<T>, loss: T) -> (T, Line<T>) {
    if loss - first.base <= first.slope * (first.origin - T::from_i32(first.cell as i32)) {
        return (first.solve::<false>(loss), first);
    }
    let u = Place::on(table, up);
    let (mut low, mut high) = (0, first.cell);
    if loss >= along_column(table, u, 0) || high == 0 {
        return (T::ZERO, Line::END);
    }
    for _ in 0..search_steps(table) {
        if high - low <= 1 {
            break;
        }
        let middle = (low + high) / 2;
        if along_column(table, u, middle) < loss {
            high = middle;
        } else {
            low = middle;
        }
    }
    let line = table.falling(up, low);
    (line.solve::<false>(loss), line)
}

/// Bisection steps for N nodes: ⌈log₂ N⌉.
#[inline(always)]
fn search_steps<T: Real, G: Grid<T>>(table: &G) -> u32 {
    table.cells().next_power_of_two().trailing_zeros()
}

/// E at `up` node `row` and any `down`.
#[inline]
fn along_row<T: Real, G: Grid<T>>(table: &G, row: usize, down: Place<T>) -> T {
    between([table.node(row, down.cell), table.node(row, down.cell + 1)], down.part)
}

/// E at any `up` and `down` node `column`.
#[inline]
fn along_column<T: Real, G: Grid<T>>(table: &G, up: Place<T>, column: usize) -> T {
    between([table.node(up.cell, column), table.node(up.cell + 1, column)], up.part)
}

/// A drive as cell number 0..N and position in the cell, 0..=1.
#[derive(Clone, Copy)]
struct Place<T> {
    cell: usize,
    part: T,
}

impl<T: Real> Place<T> {
    #[inline]
    fn on<G: Grid<T>>(table: &G, drive: T) -> Self {
        let cell = table.cell(drive);
        Self { cell, part: drive - T::from_i32(cell as i32) }
    }
}

impl<T: Real, const N: usize, const NODES: usize> Grid<T> for Everett<T, N, NODES> {
    #[inline(always)]
    fn cells(&self) -> usize {
        N
    }

    #[inline]
    fn node(&self, up: usize, down: usize) -> T {
        // The callers ensure down ≤ up ≤ N. The bound shows the compiler that there is no panic path.
        let node = index(up, down);
        self.nodes[if node < NODES { node } else { NODES - 1 }]
    }

    #[inline(always)]
    fn diagonal(&self, cell: usize) -> T {
        let node = index_on_diagonal(cell);
        self.nodes[if node < NODES { node } else { NODES - 1 }]
    }

    #[inline(always)]
    fn corners(&self, up: usize, down: usize) -> [[T; 2]; 2] {
        // Neighbours in a row. One bound serves both; it is for the compiler.
        let bounded = |index: usize| if index < NODES - 1 { index } else { NODES - 2 };
        let low = index(up, down);
        let (low, high) = (bounded(low), bounded(low + up + 1));
        [[self.nodes[low], self.nodes[low + 1]], [self.nodes[high], self.nodes[high + 1]]]
    }
}

/// Everett function of one leg in a table of a size that is known at run time.
#[derive(Debug, Clone, Copy)]
pub struct Nodes<'a, T> {
    nodes: &'a [T],
    cells: usize,
    capacity: usize,
}

impl<'a, T> Nodes<'a, T> {
    /// `nodes` as in [`Everett`], for `cells` × `cells` cells. A reversal memory keeps `capacity` extrema on it.
    ///
    /// `None` if the number of nodes does not match, or if the capacity is too small for a loop within a loop.
    #[must_use]
    pub const fn new(nodes: &'a [T], cells: usize, capacity: usize) -> Option<Self> {
        // Up to this size no product overflows.
        let fits = cells >= 1 && cells < 1 << 15 && nodes.len() == index(cells + 1, 0) && capacity >= 4;
        if fits { Some(Self { nodes, cells, capacity }) } else { None }
    }
}

impl<T: Real> Nodes<'_, T> {
    #[inline(always)]
    fn at(&self, index: usize) -> T {
        // Always in the table, see above. This form has no panic path.
        self.nodes.get(index).copied().unwrap_or(T::ZERO)
    }
}

impl<T: Real> Grid<T> for Nodes<'_, T> {
    #[inline(always)]
    fn cells(&self) -> usize {
        self.cells
    }

    #[inline(always)]
    fn capacity(&self, room: usize) -> usize {
        if self.capacity < room { self.capacity } else { room }
    }

    #[inline]
    fn node(&self, up: usize, down: usize) -> T {
        self.at(index(up, down))
    }

    #[inline(always)]
    fn diagonal(&self, cell: usize) -> T {
        self.at(index_on_diagonal(cell))
    }

    #[inline(always)]
    fn corners(&self, up: usize, down: usize) -> [[T; 2]; 2] {
        let low = index(up, down);
        let high = low + up + 1;
        [[self.at(low), self.at(low + 1)], [self.at(high), self.at(high + 1)]]
    }
}

/// Of a node.
#[inline(always)]
const fn index(up: usize, down: usize) -> usize {
    up * (up + 1) / 2 + down
}

/// Of the node at `up` = `cell` + 1 and `down` = `cell`: (cell + 1)(cell + 2)/2 + cell.
#[inline(always)]
const fn index_on_diagonal(cell: usize) -> usize {
    cell * (cell + 5) / 2 + 1
}

/// Between two values, the first at `part` 0.
#[inline(always)]
fn between<T: Real>(values: [T; 2], part: T) -> T {
    values[0] + part * (values[1] - values[0])
}
