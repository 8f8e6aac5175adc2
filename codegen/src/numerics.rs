//! Linear algebra of the host whose results reach emitted bytes: plain loops in a written order, IEEE basic operations and
//! `libm` only, so that every machine computes the same.

mod eigenvalues;
mod exponential;
mod matrix;
mod symmetric;

pub use eigenvalues::{eigenvalues, spectral_radius};
pub use exponential::exponential;
pub use matrix::{Matrix, Matrix6, multiply6, transpose6};
pub use symmetric::{generalized_modes, inverse_of_modes, symmetric_eigen};
