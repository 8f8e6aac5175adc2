//! Fourier transforms of any length: generic, so planned here they are compiled once.
//!
//! Their table of sines is that of `std`: what they compute is reported, never emitted.

use std::sync::Arc;

pub use rustfft::Fft;
pub use rustfft::num_complex::Complex64;
// Without the `avx`, `sse` features of the crate it is one kernel for every machine.
use rustfft::FftPlannerScalar;

/// Σ x_n e^(−i 2π k n/N) for N = `length`, in place.
#[must_use]
pub fn forward(length: usize) -> Arc<dyn Fft<f64>> {
    FftPlannerScalar::new().plan_fft_forward(length)
}

/// Σ x_n e^(+i 2π k n/N) for N = `length`, in place: not over N.
#[must_use]
pub fn inverse(length: usize) -> Arc<dyn Fft<f64>> {
    FftPlannerScalar::new().plan_fft_inverse(length)
}
