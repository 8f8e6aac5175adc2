//! Conversions of 6×6 matrices and 6-vectors from and to the simulator's arrays.

use host_sim::platform::{Matrix6, Six};
use nalgebra::{SMatrix, SVector};

pub(crate) type Matrix = SMatrix<f64, 6, 6>;
pub(crate) type Vector = SVector<f64, 6>;

pub(crate) fn matrix(rows: &Matrix6) -> Matrix {
    Matrix::from_fn(|row, column| rows[row][column])
}

pub(crate) fn vector(values: &Six) -> Vector {
    Vector::from_column_slice(values)
}

pub(crate) fn numbers(vector: &Vector) -> Six {
    std::array::from_fn(|k| vector[k])
}
