//! Normal equations of the fit, accumulated sparsely over Everett nodes and turned into cell weights by sums.
//!
//! Each branch has a free offset, which is eliminated by centring the branch. Slow drift and creep between the curves
//! then do not distort the table.

mod sums;

use nalgebra::DMatrix;

use super::branches::Branch;
use super::findings::Findings;
use super::record::Record;
use super::regressor::{Plane, Term};
use super::staircase::Staircase;
use crate::everett::EverettTable;
use specgen_language::diagnostic::codes;
use specgen_language::interrupt;
use specgen_numerics::nnls::Failure;

pub(super) use sums::Sums;

/// Σ over the samples of φφᵀ, φ·y and y², each centred in its branch. φ_c is the displacement of a unit weight in cell
/// c. The cells of a second table follow those of the first.
#[derive(Debug, Clone)]
pub struct Normal {
    /// Gram matrix over weights, symmetric.
    pub gram: DMatrix<f64>,
    /// One right-hand side for each target, over weights.
    pub rhs: Vec<Vec<f64>>,
    /// Σ of the squares of each centred target.
    pub energy: Vec<f64>,
    /// Samples in the sums.
    pub samples: usize,
}

impl Normal {
    /// The sum with another one of the same shape.
    pub fn add(mut self, other: &Self) -> Self {
        self.gram += &other.gram;
        for (own, more) in self.rhs.iter_mut().zip(&other.rhs) {
            own.iter_mut().zip(more).for_each(|(a, b)| *a += b);
        }
        self.energy.iter_mut().zip(&other.energy).for_each(|(a, b)| *a += b);
        self.samples += other.samples;
        self
    }
}

/// Calls `visit(sample, row)` for every sample from `first` on; `memory` is the state before it.
pub fn each_row(
    mut memory: Staircase,
    plane: &Plane,
    drive: &[f64],
    first: usize,
    mut visit: impl FnMut(usize, &[Term]),
) {
    let mut row = Vec::new();
    for (k, &u) in drive.iter().enumerate().skip(first) {
        interrupt::point();
        memory.push(u);
        plane.row(&memory, &mut row);
        visit(k, &row);
    }
}

/// Weight of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighting {
    /// Equal weights.
    Even,
    /// Every n-th sample before the second number has weight 1, the others 0.
    Every(usize, usize),
    /// Most weight if the drive is at a threshold of the grid, see [`node_weight`].
    AtNodes,
}

/// Least weight of a sample, half-way between two thresholds.
const BETWEEN: f64 = 0.01;
/// Weight of a sample with the drive at `drive` (V): 1 at a threshold, [`BETWEEN`] half-way to the next.
///
/// The table is linear between thresholds, while the actuator is curved there. With equal weights, the table would be
/// off at the nodes to fit the middle. With these weights it has the measured values at its nodes, as in the classical
/// method, and samples near the nodes still average the noise.
fn node_weight(plane: &Plane, drive: f64) -> f64 {
    let position = (drive - plane.range[0]) / plane.interval();
    let off = (position - position.round()).abs();
    let near = 1.0 - 2.0 * off;
    // Sixth power, written out: the compiler may choose the rounding of `powi`.
    let cubed = near * near * near;
    BETWEEN + (1.0 - BETWEEN) * cubed * cubed
}

/// What [`walk`] comes by.
pub enum Step<'a> {
    /// A sample of the branch of that number, and its row.
    Sample(usize, usize, &'a [Term]),
    /// The end of the branch of that number.
    End(usize),
}

/// Walks over `branches` (in ascending order; neighbours may share one sample), with negative saturation before sample
/// `first`. Rows are computed only for the `wanted` samples.
pub fn walk(
    plane: &Plane,
    record: &Record,
    first: usize,
    branches: &[Branch],
    wanted: impl Fn(usize) -> bool,
    mut visit: impl FnMut(Step),
) {
    let mut memory = Staircase::negative_saturation(plane.range);
    let mut row = Vec::new();
    let mut at = 0;
    for (k, &u) in record.drive.iter().enumerate().skip(first) {
        interrupt::point();
        memory.push(u);
        let Some(branch) = branches.get(at) else { break };
        if k < branch.first {
            continue;
        }
        let counts = !record.weightless[k] && wanted(k);
        if counts {
            plane.row(&memory, &mut row);
        }
        // The sample of a reversal ends one branch and starts the next.
        while let Some(branch) = branches.get(at).filter(|branch| k >= branch.first) {
            if counts {
                visit(Step::Sample(at, k, &row));
            }
            if k + 1 < branch.end {
                break;
            }
            visit(Step::End(at));
            at += 1;
        }
    }
}

/// Weight of sample `k`.
pub fn weight(weighting: Weighting, plane: &Plane, record: &Record, k: usize) -> f64 {
    match weighting {
        Weighting::Even => 1.0,
        Weighting::Every(n, end) => f64::from(u8::from(k < end && k.is_multiple_of(n))),
        Weighting::AtNodes => node_weight(plane, record.drive[k]),
    }
}

/// Normal equations over `branches` (in ascending order; neighbours may share one sample).
///
/// `fill` writes the `targets` targets of a sample. It is called with samples in ascending order, and twice for a
/// sample that two branches share.
#[must_use]
pub fn accumulate(
    plane: &Plane,
    record: &Record,
    first: usize,
    branches: &[Branch],
    weighting: Weighting,
    targets: usize,
    mut fill: impl FnMut(usize, &mut [f64]),
) -> Normal {
    let mut sums = Sums::new(plane.nodes(), targets);
    let mut values = vec![0.0; targets];
    let counts = |k| weight(weighting, plane, record, k) > 0.0;
    walk(plane, record, first, branches, counts, |step| match step {
        Step::Sample(_, k, row) => {
            fill(k, &mut values);
            sums.add(row, &values, weight(weighting, plane, record, k));
        }
        Step::End(_) => sums.close_branch(),
    });
    sums.over_weights(plane)
}

/// Reports normal equations that have no solution.
pub(crate) fn report_undetermined(failure: &Failure, findings: &mut Findings) {
    let message = format!("the weights cannot be determined ({failure:?})");
    findings.add(codes::NOT_DETERMINED, None, message, "choose a smaller grid, or record more reversal curves");
}

/// Cell weights to Everett nodes, in place: E(i, j) is the sum of the weights with up ≤ i, down ≥ j.
fn weights_to_nodes(grid: usize, values: &mut [f64]) {
    for up in 1..=grid {
        for down in (0..up.saturating_sub(1)).rev() {
            values[EverettTable::index(up, down)] += values[EverettTable::index(up, down + 1)];
        }
    }
    for up in 2..=grid {
        for down in 0..up - 1 {
            values[EverettTable::index(up, down)] += values[EverettTable::index(up - 1, down)];
        }
    }
}

/// The table of cell weights given in units of `unit` (m, or m s/V).
pub fn table_of(plane: &Plane, weights: &[f64], unit: f64) -> EverettTable {
    let mut nodes: Vec<f64> = weights.iter().map(|w| w * unit).collect();
    weights_to_nodes(plane.grid, &mut nodes);
    let [drive_min, drive_max] = plane.range;
    EverettTable { grid: plane.grid, drive_min, drive_max, nodes }
}
