//! Normal equations of a record at any rate, and one static table for several records at once.

use core::cell::RefCell;

use nalgebra::DMatrix;

use super::prepare::PreparedRecord;
use crate::everett::EverettTable;
use crate::normal::{self, Normal, Step, Sums, walk};
use crate::prior;
use crate::regressor::Plane;
use specgen_language::interrupt;
use specgen_numerics::nnls::{self, Failure};

/// Normal equations over the branches of `p`, each with a free offset, as shares of its samples: the weights of Γ₀, then with `rate_unit`
/// those of Γ₁, with rates in this unit (V/s). `targets` are over the used part (m).
pub(super) fn accumulate(plane: &Plane, p: &PreparedRecord, targets: &[Vec<f64>], rate_unit: Option<f64>) -> Normal {
    let unknowns = if rate_unit.is_some() { 2 * plane.nodes() } else { plane.nodes() };
    over(Sums::new(unknowns, targets.len()), plane, p, targets, rate_unit)
}

fn over(mut sums: Sums, plane: &Plane, p: &PreparedRecord, targets: &[Vec<f64>], rate_unit: Option<f64>) -> Normal {
    let (mut full, mut values) = (Vec::new(), vec![0.0; targets.len()]);
    let visit = |step: Step| match step {
        Step::Sample(_, k, row) => {
            full.clear();
            full.extend_from_slice(row);
            if let Some(unit) = rate_unit {
                full.extend(row.iter().map(|(node, c)| (plane.nodes() + node, c * p.slope[k] / unit)));
            }
            values.iter_mut().zip(targets).for_each(|(value, target)| *value = target[k - p.first]);
            sums.add(&full, &values, 1.0);
        }
        Step::End(_) => sums.close_branch(),
    };
    walk(plane, p.record, p.first, &p.branches, |_| true, visit);
    let Normal { gram, rhs, energy, samples } = sums.over_weights(plane);
    let share = 1.0 / samples.max(1) as f64;
    let shares = |values: Vec<f64>| values.into_iter().map(|x| x * share).collect();
    let rhs = rhs.into_iter().map(shares).collect();
    Normal { gram: gram.transpose() * share, rhs, energy: shares(energy), samples }
}

/// Tables for the same drives and different displacements: everything that depends only on the drives is kept.
pub(super) struct Tables<'a> {
    pub(super) plane: &'a Plane,
    pub(super) records: &'a [&'a PreparedRecord<'a>],
    gram: DMatrix<f64>,
    /// The weights found last.
    near: RefCell<Vec<f64>>,
}

impl<'a> Tables<'a> {
    /// Of these records.
    pub(super) fn new(plane: &'a Plane, records: &'a [&'a PreparedRecord<'a>]) -> Result<Self, Failure> {
        let each = records.iter().map(|p| accumulate(plane, p, &[], None));
        let mut gram = each.reduce(|sum, more| sum.add(&more)).ok_or(Failure::Singular)?.gram;
        prior::add(plane.grid, &mut gram);
        Ok(Self { plane, records, gram, near: RefCell::default() })
    }

    /// The table that fits `targets` (m, one for each record) best.
    pub(super) fn fit(&self, targets: &[Vec<f64>]) -> Result<EverettTable, Failure> {
        let mut sum = vec![0.0; self.plane.nodes()];
        for (p, y) in self.records.iter().zip(targets) {
            let right_side = Sums::without_gram(self.plane.nodes(), 1);
            let rhs = over(right_side, self.plane, p, core::slice::from_ref(y), None).rhs;
            sum.iter_mut().zip(&rhs[0]).for_each(|(sum, b)| *sum += b);
        }
        // Scaled to order one: the tolerances of the solver are relative, and small weights keep their digits.
        let scale = 1.0 / size(&sum);
        sum.iter_mut().for_each(|b| *b *= scale);
        interrupt::point();
        let weights = nnls::solve_from(&self.gram, &sum, &self.near.borrow())?.weights;
        let table = normal::table_of(self.plane, &weights, 1.0 / scale);
        self.near.replace(weights);
        Ok(table)
    }
}

/// Largest absolute value, not zero.
pub(super) fn size(values: &[f64]) -> f64 {
    values.iter().fold(f64::MIN_POSITIVE, |most, v| if v.abs() > most { v.abs() } else { most })
}
