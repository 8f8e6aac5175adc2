//! Sums over Everett nodes, branch by branch, and their transformation to sums over cell weights.

use nalgebra::DMatrix;

use super::Normal;
use crate::everett::EverettTable;
use crate::regressor::{Plane, Term};

/// Running sums over Everett nodes, of one table or of several in sequence.
pub struct Sums {
    /// Lower triangle; empty if it is not needed.
    gram: DMatrix<f64>,
    rhs: Vec<Vec<f64>>,
    energy: Vec<f64>,
    samples: usize,
    branch: BranchSums,
}

/// Sums of the branch under way.
struct BranchSums {
    samples: usize,
    weight: f64,
    row: Vec<f64>,
    touched: Vec<usize>,
    /// First value of each target in the branch. Targets are relative to it, which keeps the sums small.
    origin: Vec<f64>,
    target: Vec<f64>,
}

impl Sums {
    /// Empty sums for this number of unknowns.
    pub fn new(unknowns: usize, targets: usize) -> Self {
        Self { gram: DMatrix::zeros(unknowns, unknowns), ..Self::without_gram(unknowns, targets) }
    }

    /// The same of right-hand sides alone.
    pub fn without_gram(unknowns: usize, targets: usize) -> Self {
        let branch = BranchSums {
            samples: 0,
            weight: 0.0,
            row: vec![0.0; unknowns],
            touched: Vec::new(),
            origin: vec![0.0; targets],
            target: vec![0.0; targets],
        };
        Self {
            gram: DMatrix::zeros(0, 0),
            rhs: vec![vec![0.0; unknowns]; targets],
            energy: vec![0.0; targets],
            samples: 0,
            branch,
        }
    }

    /// One sample of the present branch: its row, its targets, and its weight.
    pub fn add(&mut self, row: &[Term], targets: &[f64], weight: f64) {
        let branch = &mut self.branch;
        for (k, &target) in targets.iter().enumerate() {
            if branch.samples == 0 {
                branch.origin[k] = target;
            }
            let y = target - branch.origin[k];
            branch.target[k] += weight * y;
            self.energy[k] += weight * y * y;
            for &(node, c) in row {
                self.rhs[k][node] += weight * c * y;
            }
        }
        branch.samples += 1;
        branch.weight += weight;
        for &(a, ca) in row {
            if branch.row[a] == 0.0 {
                branch.touched.push(a);
            }
            branch.row[a] += weight * ca;
            for &(b, cb) in if self.gram.is_empty() { &[] } else { row } {
                if a >= b {
                    self.gram[(a, b)] += weight * ca * cb;
                }
            }
        }
    }

    /// Ends the branch and subtracts its mean: Σw(x − x̄)(y − ȳ) = Σwxy − ΣwxΣwy/Σw.
    pub fn close_branch(&mut self) {
        let branch = &mut self.branch;
        if branch.samples == 0 {
            return;
        }
        branch.touched.sort_unstable();
        branch.touched.dedup();
        let share = 1.0 / branch.weight;
        for (k, &sum) in branch.target.iter().enumerate() {
            self.energy[k] -= sum * sum * share;
            for &node in &branch.touched {
                self.rhs[k][node] -= branch.row[node] * sum * share;
            }
        }
        for &a in if self.gram.is_empty() { &[] } else { branch.touched.as_slice() } {
            for &b in branch.touched.iter().take_while(|b| **b <= a) {
                self.gram[(a, b)] -= branch.row[a] * branch.row[b] * share;
            }
        }
        for &node in &branch.touched {
            branch.row[node] = 0.0;
        }
        branch.touched.clear();
        branch.target.fill(0.0);
        branch.weight = 0.0;
        self.samples += branch.samples;
        branch.samples = 0;
    }

    /// The same over cell weights.
    pub fn over_weights(self, plane: &Plane) -> Normal {
        let Self { mut gram, mut rhs, energy, samples, .. } = self;
        mirror(&mut gram);
        let to_weights =
            |values: &mut [f64]| values.chunks_mut(plane.nodes()).for_each(|table| nodes_to_weights(plane.grid, table));
        gram.column_iter_mut().for_each(|mut column| to_weights(column.as_mut_slice()));
        gram.transpose_mut();
        gram.column_iter_mut().for_each(|mut column| to_weights(column.as_mut_slice()));
        rhs.iter_mut().for_each(|b| to_weights(b));
        Normal { gram, rhs, energy, samples }
    }
}

fn mirror(gram: &mut DMatrix<f64>) {
    for column in 0..gram.ncols() {
        for row in 0..column {
            gram[(row, column)] = gram[(column, row)];
        }
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
