//! One row of the regression: dependence of the model's displacement on the nodes of the Everett table.
//!
//! With the memory p_0 < p_1 > p_2 < … p_m = u (the last one is the drive) the model's displacement above negative
//! saturation is f = E(p_1, p_0) − E(p_1, p_2) + E(p_3, p_2) − …, and E is linear in its nodes, so f is too.

use super::staircase::Staircase;
use crate::everett::EverettTable;

/// Everett nodes of a grid over a drive range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// N, intervals per axis.
    pub grid: usize,
    /// Lowest and highest threshold, V.
    pub range: [f64; 2],
}

/// A coefficient of the node at position [`EverettTable::index`].
pub type Term = (usize, f64);

impl Plane {
    /// Number of nodes, and of cells: N (N + 1) / 2.
    #[must_use]
    pub const fn nodes(&self) -> usize {
        self.grid * (self.grid + 1) / 2
    }

    /// Width of a cell, V.
    #[must_use]
    pub fn interval(&self) -> f64 {
        (self.range[1] - self.range[0]) / self.grid as f64
    }

    /// Adds the terms of `sign`·E(`up`, `down`), drive in V, to `row`; nothing if `up` ≤ `down`.
    pub fn add_everett(&self, up: f64, down: f64, sign: f64, row: &mut Vec<Term>) {
        let (i, up_part) = self.cell(up);
        let (j, down_part) = self.cell(down);
        if i == j {
            // Triangle on the diagonal: E is linear and vanishes on the diagonal.
            push(row, i + 1, j, sign * (up_part - down_part));
        } else if i > j {
            push(row, i, j, sign * (1.0 - up_part) * (1.0 - down_part));
            push(row, i + 1, j, sign * up_part * (1.0 - down_part));
            push(row, i, j + 1, sign * (1.0 - up_part) * down_part);
            push(row, i + 1, j + 1, sign * up_part * down_part);
        }
    }

    /// Writes the row of the memory's present state. Nodes may repeat in a row; their coefficients add.
    pub fn row(&self, memory: &Staircase, row: &mut Vec<Term>) {
        row.clear();
        for (k, pair) in memory.extrema().windows(2).enumerate() {
            if k % 2 == 0 {
                self.add_everett(pair[1], pair[0], 1.0, row);
            } else {
                self.add_everett(pair[0], pair[1], -1.0, row);
            }
        }
    }

    /// Index of the interval that contains `drive`, and the position in it from 0 to 1.
    fn cell(&self, drive: f64) -> (usize, f64) {
        let position = (drive - self.range[0]) / self.interval();
        // A float-to-integer cast saturates, so that no drive leads outside the grid.
        let index = (position as usize).min(self.grid - 1);
        (index, super::staircase::saturate(position - index as f64, [0.0, 1.0]))
    }
}

fn push(row: &mut Vec<Term>, up: usize, down: usize, coefficient: f64) {
    if up > down && coefficient != 0.0 {
        row.push((EverettTable::index(up, down), coefficient));
    }
}

/// Σ coefficient·node of a row: the model's displacement above negative saturation, in the unit of `nodes`.
#[must_use]
pub fn evaluate(row: &[Term], nodes: &[f64]) -> f64 {
    row.iter().fold(0.0, |sum, &(node, coefficient)| sum + coefficient * nodes[node])
}
