//! Normal equations of a table, and of a second one times the rate, over all branches of one record, each with a free offset.

use nalgebra::DMatrix;

use super::prepare::Prepared;
use crate::everett::EverettTable;
use crate::identify::normal::each_row;
use crate::identify::regressor::{Plane, Term};

/// Sums over cell weights, as shares of the samples: first the weights of Γ₀, then those of Γ₁ if there are any.
#[derive(Clone)]
pub(super) struct Normal {
    /// Symmetric.
    pub(super) gram: DMatrix<f64>,
    /// One for each target.
    pub(super) rhs: Vec<Vec<f64>>,
    /// Σ of the squares of each centred target.
    pub(super) energy: Vec<f64>,
}

impl Normal {
    /// The sum with another one of the same shape.
    pub(super) fn add(mut self, other: &Self) -> Self {
        self.gram += &other.gram;
        for (own, more) in self.rhs.iter_mut().zip(&other.rhs) {
            own.iter_mut().zip(more).for_each(|(a, b)| *a += b);
        }
        self.energy.iter_mut().zip(&other.energy).for_each(|(a, b)| *a += b);
        self
    }
}

/// Over the branches of `p`. `targets` are over its used part (m). `rate_unit`: also the second table, with rates in this
/// unit (V/s).
pub(super) fn accumulate(plane: &Plane, p: &Prepared, targets: &[Vec<f64>], rate_unit: Option<f64>) -> Normal {
    let nodes = plane.nodes();
    let unknowns = if rate_unit.is_some() { 2 * nodes } else { nodes };
    let mut sums = Sums::new(unknowns, targets.len());
    let mut full = Vec::new();
    let mut pending = p.branches.iter().peekable();
    each_row(plane, &p.record.drive, p.first, |k, row| {
        full.clear();
        full.extend_from_slice(row);
        if let Some(unit) = rate_unit {
            full.extend(row.iter().map(|(node, c)| (nodes + node, c * p.slope[k] / unit)));
        }
        while let Some(branch) = pending.peek() {
            if k >= branch.first && !p.record.weightless[k] {
                sums.add(&full, targets, k - p.first);
            }
            if k + 1 < branch.end {
                break;
            }
            sums.close_branch();
            pending.next();
            // The sample of a reversal ends one branch and starts the next.
            if pending.peek().is_none_or(|next| next.first > k) {
                break;
            }
        }
    });
    sums.close_branch();
    sums.finish(plane.grid, nodes)
}

/// Running sums over nodes.
struct Sums {
    /// Lower triangle.
    gram: DMatrix<f64>,
    rhs: Vec<Vec<f64>>,
    energy: Vec<f64>,
    samples: usize,
    /// Of the branch under way: samples, Σ row, Σ target (from its first value on).
    count: f64,
    row: Vec<f64>,
    touched: Vec<usize>,
    origin: Vec<f64>,
    target: Vec<f64>,
}

impl Sums {
    fn new(unknowns: usize, targets: usize) -> Self {
        Self {
            gram: DMatrix::zeros(unknowns, unknowns),
            rhs: vec![vec![0.0; unknowns]; targets],
            energy: vec![0.0; targets],
            samples: 0,
            count: 0.0,
            row: vec![0.0; unknowns],
            touched: Vec::new(),
            origin: vec![0.0; targets],
            target: vec![0.0; targets],
        }
    }

    fn add(&mut self, row: &[Term], targets: &[Vec<f64>], sample: usize) {
        for (k, target) in targets.iter().enumerate() {
            if self.count == 0.0 {
                self.origin[k] = target[sample];
            }
            let y = target[sample] - self.origin[k];
            self.target[k] += y;
            self.energy[k] += y * y;
            for &(node, c) in row {
                self.rhs[k][node] += c * y;
            }
        }
        self.count += 1.0;
        self.samples += 1;
        for &(a, ca) in row {
            if self.row[a] == 0.0 {
                self.touched.push(a);
            }
            self.row[a] += ca;
            for &(b, cb) in row {
                if a >= b {
                    self.gram[(a, b)] += ca * cb;
                }
            }
        }
    }

    /// Subtracts the mean of the branch: Σ(x − x̄)(y − ȳ) = Σxy − ΣxΣy/n.
    fn close_branch(&mut self) {
        if self.count == 0.0 {
            return;
        }
        self.touched.sort_unstable();
        self.touched.dedup();
        let share = 1.0 / self.count;
        for (k, sum) in self.target.iter_mut().enumerate() {
            self.energy[k] -= *sum * *sum * share;
            for &node in &self.touched {
                self.rhs[k][node] -= self.row[node] * *sum * share;
            }
            *sum = 0.0;
        }
        for &a in &self.touched {
            for &b in self.touched.iter().take_while(|b| **b <= a) {
                self.gram[(a, b)] -= self.row[a] * self.row[b] * share;
            }
        }
        for &node in &self.touched {
            self.row[node] = 0.0;
        }
        self.touched.clear();
        self.count = 0.0;
    }

    /// Over weights, as shares of the samples.
    fn finish(self, grid: usize, nodes: usize) -> Normal {
        let Self { mut gram, mut rhs, mut energy, samples, .. } = self;
        let unknowns = gram.ncols();
        for column in 0..unknowns {
            for row in 0..column {
                gram[(row, column)] = gram[(column, row)];
            }
        }
        let to_weights = |values: &mut [f64]| values.chunks_mut(nodes).for_each(|block| nodes_to_weights(grid, block));
        for _ in 0..2 {
            for column in 0..unknowns {
                to_weights(gram.column_mut(column).as_mut_slice());
            }
            gram.transpose_mut();
        }
        let share = 1.0 / samples.max(1) as f64;
        gram *= share;
        for b in &mut rhs {
            to_weights(b);
            b.iter_mut().for_each(|x| *x *= share);
        }
        energy.iter_mut().for_each(|e| *e *= share);
        Normal { gram, rhs, energy }
    }
}

/// Gradient over nodes to gradient over weights, in place: the weight of cell (a, b) adds to every node with up ≥ a, down ≤ b.
fn nodes_to_weights(grid: usize, values: &mut [f64]) {
    for up in 1..=grid {
        for down in 1..up {
            values[EverettTable::index(up, down)] += values[EverettTable::index(up, down - 1)];
        }
    }
    for up in (1..grid).rev() {
        for down in 0..up {
            values[EverettTable::index(up, down)] += values[EverettTable::index(up + 1, down)];
        }
    }
}
