//! One static table for several records at once.

use super::normal::{Normal, accumulate};
use super::prepare::Prepared;
use crate::everett::EverettTable;
use crate::regressor::Plane;
use crate::{normal, prior};
use specgen_numerics::nnls::{self, Failure};

/// The table that fits `targets` (m, one for each record) best.
pub(super) fn fit(plane: &Plane, records: &[&Prepared], targets: &[Vec<f64>]) -> Result<EverettTable, Failure> {
    let mut normal = sum(plane, records, targets).ok_or(Failure::Singular)?;
    prior::add(plane.grid, &mut normal.gram);
    // To order one: the tolerances of the solver are relative, and so small weights keep their digits.
    let scale = 1.0 / size(&normal.rhs[0]);
    let rhs: Vec<f64> = normal.rhs[0].iter().map(|b| b * scale).collect();
    Ok(normal::table_of(plane, &nnls::solve(&normal.gram, &rhs)?.weights, 1.0 / scale))
}

/// Sum of the normal equations of the records, with one target each and none of the second table.
fn sum(plane: &Plane, records: &[&Prepared], targets: &[Vec<f64>]) -> Option<Normal> {
    let each = records.iter().zip(targets).map(|(p, y)| accumulate(plane, p, core::slice::from_ref(y), None));
    each.reduce(|sum, more| sum.add(&more))
}

/// Largest absolute value, not zero.
pub(super) fn size(values: &[f64]) -> f64 {
    values.iter().fold(f64::MIN_POSITIVE, |most, v| if v.abs() > most { v.abs() } else { most })
}
