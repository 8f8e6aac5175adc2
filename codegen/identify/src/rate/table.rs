//! One static table for several records at once.

use core::cell::RefCell;

use nalgebra::DMatrix;

use super::normal::{accumulate, right_sides};
use super::prepare::PreparedRecord;
use crate::everett::EverettTable;
use crate::regressor::Plane;
use crate::{normal, prior};
use specgen_language::interrupt;
use specgen_numerics::nnls::{self, Failure};

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
            let [rhs] = &right_sides(self.plane, p, core::slice::from_ref(y))[..] else {
                return Err(Failure::Singular);
            };
            sum.iter_mut().zip(rhs).for_each(|(sum, b)| *sum += b);
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
