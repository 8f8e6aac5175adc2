//! Normal equations of a table, and of a second one times the rate, over all branches of one record, each with a free
//! offset.

use nalgebra::DMatrix;

use super::prepare::PreparedRecord;
use crate::normal::{Sums, each_row};
use crate::regressor::Plane;

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

/// Over the branches of `p`. `targets` are over its used part (m). With `rate_unit`, also the second table, with rates
/// in this unit (V/s).
pub(super) fn accumulate(plane: &Plane, p: &PreparedRecord, targets: &[Vec<f64>], rate_unit: Option<f64>) -> Normal {
    let unknowns = if rate_unit.is_some() { 2 * plane.nodes() } else { plane.nodes() };
    over(Sums::new(unknowns, targets.len()), plane, p, targets, rate_unit)
}

/// The right-hand sides alone, of one table.
pub(super) fn right_sides(plane: &Plane, p: &PreparedRecord, targets: &[Vec<f64>]) -> Vec<Vec<f64>> {
    over(Sums::without_gram(plane.nodes(), targets.len()), plane, p, targets, None).rhs
}

fn over(mut sums: Sums, plane: &Plane, p: &PreparedRecord, targets: &[Vec<f64>], rate_unit: Option<f64>) -> Normal {
    let nodes = plane.nodes();
    let mut full = Vec::new();
    let mut values = vec![0.0; targets.len()];
    let mut pending = p.branches.iter().peekable();
    each_row(plane, &p.record.drive, p.first, |k, row| {
        full.clear();
        full.extend_from_slice(row);
        if let Some(unit) = rate_unit {
            full.extend(row.iter().map(|(node, c)| (nodes + node, c * p.slope[k] / unit)));
        }
        while let Some(branch) = pending.peek() {
            if k >= branch.first && !p.record.weightless[k] {
                values.iter_mut().zip(targets).for_each(|(value, target)| *value = target[k - p.first]);
                sums.add(&full, &values, 1.0);
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
    let all = sums.over_weights(plane);
    let share = 1.0 / all.samples.max(1) as f64;
    let shares = |values: Vec<f64>| values.into_iter().map(|x| x * share).collect();
    Normal {
        gram: all.gram.transpose() * share,
        rhs: all.rhs.into_iter().map(shares).collect(),
        energy: shares(all.energy),
    }
}
