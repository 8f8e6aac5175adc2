//! The Everett function on a grid.
//!
//! E(up, down) is the displacement that a rise of the drive from `down` to `up` adds when it starts at a
//! reversal (and that the fall from `up` to `down` takes away). It is what first-order reversal curves measure, and
//! the double integral of the Preisach weight over the triangle down ≤ down' ≤ up' ≤ up.
//!
//! Drives are counted in *cells* above the lowest threshold: 0 ≤ x ≤ N. Between nodes E is bilinear in square cells
//! (uniform weight) and linear in the triangles on the diagonal (their weight is reversible).

use crate::real::Real;

/// Everett function of one leg: `N` × `N` cells, `NODES` = (N+1)(N+2)/2 nodes.
///
/// `nodes` holds E(i, j) for `up` threshold i = 0..=N and, in each row, `down` threshold j = 0..=i, so that
/// E(i, j) is at i(i+1)/2 + j and the diagonal E(i, i) is zero. Metres. Values rise with i and fall with j.
#[derive(Debug, Clone, Copy)]
pub struct Everett<T: 'static, const N: usize, const NODES: usize> {
    /// See the type.
    pub nodes: &'static [T; NODES],
}

/// A drive, taken apart: cell number 0..N and the place in it, 0..=1.
#[derive(Clone, Copy)]
struct Place<T> {
    cell: usize,
    part: T,
}

impl<T: Real, const N: usize, const NODES: usize> Everett<T, N, NODES> {
    /// Bisection steps that separate N nodes: ⌈log₂ N⌉.
    const SEARCH_STEPS: u32 = N.next_power_of_two().trailing_zeros();

    /// Largest drive, N cells.
    #[inline]
    #[must_use]
    pub fn full_scale(&self) -> T {
        T::from_i32(N as i32)
    }

    /// Displacement at full drive after saturation, E(N, 0), m.
    #[inline]
    #[must_use]
    pub fn full_displacement(&self) -> T {
        self.node(N, 0)
    }

    /// E(`up`, `down`) in m, for 0 ≤ `down` ≤ `up` ≤ N cells.
    #[inline]
    #[must_use]
    pub fn value(&self, up: T, down: T) -> T {
        let (u, d) = (Self::place(up), Self::place(down));
        if u.cell == d.cell {
            return self.node(u.cell + 1, u.cell) * (up - down);
        }
        let below = self.along_row(u.cell, d);
        let above = self.along_row(u.cell + 1, d);
        below + u.part * (above - below)
    }

    /// The drive above `down` at which a rise from `down` has added `gain` (m): solves E(x, `down`) = `gain`.
    ///
    /// `least` is a drive that the solution is known not to lie below, `down` at the least: the search begins in its cell,
    /// where a tracking leg finds it. `gain` beyond what full drive gives yields N. Where the table is flat, the smallest
    /// solution not below the cell of `least`.
    #[inline]
    #[must_use]
    pub fn rise(&self, down: T, least: T, gain: T) -> T {
        let d = Self::place(down);
        let first = Self::place(least).cell;
        // E at the lower node of the cell, zero where the cell is the diagonal one and holds `down` itself.
        let mut low = first;
        let mut at_low = if first > d.cell { self.along_row(first, d) } else { T::ZERO };
        let mut high = first + 1;
        let mut at_high = self.along_row(high, d);
        if gain > at_high {
            (low, at_low) = (high, at_high);
            high = N;
            at_high = self.along_row(high, d);
            if gain >= at_high {
                return self.full_scale();
            }
            // E(low, down) < gain < E(high, down) holds from here on.
            for _ in 0..Self::SEARCH_STEPS {
                if high - low <= 1 {
                    break;
                }
                let middle = (low + high) / 2;
                let at_middle = self.along_row(middle, d);
                if at_middle < gain {
                    (low, at_low) = (middle, at_middle);
                } else {
                    (high, at_high) = (middle, at_middle);
                }
            }
        } else if low <= d.cell {
            return Self::step_from(down, gain, self.node(high, d.cell), T::ONE);
        }
        Self::step_from(T::from_i32(low as i32), gain - at_low, at_high - at_low, T::ONE)
    }

    /// The drive below `up` at which a fall from `up` has taken away `loss` (m): solves E(`up`, x) = `loss`.
    ///
    /// `most` is a drive that the solution is known not to lie above, `up` at the most: the search begins in its cell.
    /// `loss` beyond what zero drive takes yields 0. Where the table is flat, the largest solution not above the cell of
    /// `most`.
    #[inline]
    #[must_use]
    pub fn fall(&self, up: T, most: T, loss: T) -> T {
        let u = Self::place(up);
        let first = Self::place(most).cell;
        let mut high = first + 1;
        let mut at_high = if first < u.cell { self.along_column(u, high) } else { T::ZERO };
        let mut low = first;
        let mut at_low = self.along_column(u, low);
        if loss > at_low {
            (high, at_high) = (low, at_low);
            low = 0;
            at_low = self.along_column(u, low);
            if loss >= at_low {
                return T::ZERO;
            }
            // E(up, high) < loss < E(up, low) holds from here on.
            for _ in 0..Self::SEARCH_STEPS {
                if high - low <= 1 {
                    break;
                }
                let middle = (low + high) / 2;
                let at_middle = self.along_column(u, middle);
                if at_middle < loss {
                    (high, at_high) = (middle, at_middle);
                } else {
                    (low, at_low) = (middle, at_middle);
                }
            }
        } else if high > u.cell {
            return Self::step_from(up, loss, self.node(high, u.cell), -T::ONE);
        }
        Self::step_from(T::from_i32(high as i32), loss - at_high, at_low - at_high, -T::ONE)
    }

    /// Within a cell E is linear along a branch: `change` / `slope` cells from `start`. Where it is flat, `start`.
    #[inline]
    fn step_from(start: T, change: T, slope: T, direction: T) -> T {
        if slope > T::ZERO { start + direction * (change / slope) } else { start }
    }

    /// E at `up` node `row` and any `down`.
    #[inline]
    fn along_row(&self, row: usize, down: Place<T>) -> T {
        // Neighbours in a row: one bound, for the compiler, serves both.
        let index = row * (row + 1) / 2 + down.cell;
        let index = if index < NODES - 1 { index } else { NODES - 2 };
        let at_cell = self.nodes[index];
        at_cell + down.part * (self.nodes[index + 1] - at_cell)
    }

    /// E at any `up` and `down` node `column`.
    #[inline]
    fn along_column(&self, up: Place<T>, column: usize) -> T {
        let at_cell = self.node(up.cell, column);
        at_cell + up.part * (self.node(up.cell + 1, column) - at_cell)
    }

    #[inline]
    fn place(drive: T) -> Place<T> {
        let whole = drive.truncate();
        let last = N as i32 - 1;
        let whole = if whole > last { last } else { whole };
        let whole = if whole < 0 { 0 } else { whole };
        Place { cell: whole as usize, part: drive - T::from_i32(whole) }
    }

    #[inline]
    fn node(&self, up: usize, down: usize) -> T {
        // The callers keep down ≤ up ≤ N; the bound is for the compiler, which then sees no panic path.
        let index = up * (up + 1) / 2 + down;
        self.nodes[if index < NODES { index } else { NODES - 1 }]
    }
}
