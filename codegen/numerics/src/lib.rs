//! Numerics of the host that determine emitted bytes: plain loops in a written order, only IEEE basic operations and
//! `libm`, so that every computer gives the same bits.
//!
//! | part | what |
//! |---|---|
//! | [`Matrix`], [`Matrix6`] | dense matrices, eigenvalues, modes of mass and stiffness, exponential |
//! | [`dot`], [`cross`], [`norm`], [`rotation`] | vectors of space |
//! | [`diagonalize`] | eigenvalues of a symmetric matrix of any size, by Jacobi rotations |
//! | [`Double`] | numbers of 106 bits: the reference for rounding errors |
//! | [`TracedNumber`] | numbers that record every operation: bounds of rounding errors over a box of poses |
//! | [`Taylor`] | Taylor models: polynomials of a motion about rest, with a bound of the remainder |
//! | [`ewma_limit`], [`pcc_limit`] | Jury limits of the run-to-run laws |
//! | [`Factor`] | Cholesky factors of large matrices, by blocks |
//! | [`nnls`] | non-negative least squares: the weights of a hysteresis table |
//! | [`largest`], [`simplex`] | bisection for the limit of a condition; Nelder-Mead for the least cost |
//! | [`Cma`] | global search for the least cost |
//! | [`Resolvent`] | frequency response of a sampled system |
//! | [`Loci`] | stability boundary of a loop of six modes over structural modes |
//! | [`steady_covariances`] | steady-state covariance of a sampled system under white noise |
//! | [`fft`] | Fourier transforms |
//! | [`complex6`] | complex 6×6 matrices |
//! | [`nyquist`] | sensitivity and stability of a loop of one signal |
//! | [`Kernels`], [`displacements`], [`leg_forces`], [`mass_matrix`] and others | the controller's kernels on these numbers, compiled here |
//!
//! A separate crate because it is optimised for speed, which the rest of the compiler is not.

mod cholesky;
mod cma;
pub mod complex6;
mod covariance;
mod double;
mod eigenvalues;
mod exponential;
pub mod fft;
mod form;
mod jury;
mod kernels;
mod loci;
mod matrix;
pub mod nnls;
pub mod nyquist;
mod resolvent;
mod search;
mod space;
mod symmetric;
mod taylor;
mod traced;

pub use cholesky::Factor;
pub use cma::{Cma, ranked, unit_interval};
pub use covariance::steady_covariances;
pub use double::Double;
pub use eigenvalues::{eigenvalues, spectral_radius};
pub use exponential::exponential;
pub use form::magnitude;
pub use jury::{ewma_limit, pcc_limit};
pub use kernels::{
    Kernels, coriolis, coupled, displacements, expand_leg_forces, gravity, jacobian, leg_forces, mass_matrix,
    pivot_ratio,
};
pub use loci::{ComplexMatrix, Loci, complex_eigenvalues, product};
pub use matrix::{Matrix, Matrix6, multiply6, transpose6};
pub use resolvent::Resolvent;
pub use search::{largest, simplex};
pub use space::{cross, dot, norm, rotation};
pub use symmetric::{diagonalize, generalized_modes, inverse_of_modes, symmetric_eigen};
pub use taylor::{Expansion, Taylor, expand};
pub use traced::{Trace, TracedNumber, trace};
