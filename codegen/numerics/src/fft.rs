//! Fourier transforms of any length.
//!
//! Its sines are those of `std`: the results are reported, never emitted.

use std::sync::Arc;

pub use rustfft::Fft;
use rustfft::FftDirection;
pub use rustfft::num_complex::Complex64;
// Without the features `avx` and `sse` of the crate, it is one kernel for every machine. Its planner would link kernels
// for all lengths.
use rustfft::algorithm::butterflies::Butterfly8;
use rustfft::algorithm::{BluesteinsAlgorithm, Radix4};

/// Σ x_n e^(−i 2π k n/N) for N = `length`, at least 1, in place. A power of two takes a quarter of the time of other lengths.
pub fn forward(length: usize) -> Arc<dyn Fft<f64>> {
    transform(length, FftDirection::Forward)
}

/// Σ x_n e^(+i 2π k n/N) for N = `length`, at least 1, in place: without the factor 1/N.
pub fn inverse(length: usize) -> Arc<dyn Fft<f64>> {
    transform(length, FftDirection::Inverse)
}

fn transform(length: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
    if length.is_power_of_two() {
        return Arc::new(radix4(length, direction));
    }
    let inner = radix4((2 * length).next_power_of_two(), direction);
    Arc::new(BluesteinsAlgorithm::new(length, Arc::new(inner)))
}

/// For a power of two, with the base, and so the bits, of the crate's planner.
fn radix4(length: usize, direction: FftDirection) -> Radix4<f64> {
    let exponent = length.trailing_zeros();
    if exponent > 5 && exponent % 2 == 1 {
        Radix4::new_with_base((exponent - 3) / 2, Arc::new(Butterfly8::new(direction)))
    } else {
        Radix4::new(length, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn every_length_is_the_sum_of_its_definition() {
        for length in [1, 2, 3, 31, 32, 60, 64, 97, 128, 1000] {
            let values: Vec<Complex64> =
                (0..length).map(|n| Complex64::new(((n * n) % 17) as f64, ((n * 5) % 13) as f64 - 6.0)).collect();
            for (transform, sign) in [(forward(length), -1.0), (inverse(length), 1.0)] {
                let mut found = values.clone();
                transform.process(&mut found);
                for (k, found) in found.iter().enumerate() {
                    let term = |(n, value): (usize, &Complex64)| {
                        let turn = sign * TAU * ((k * n) % length) as f64 / length as f64;
                        value * Complex64::new(libm::cos(turn), libm::sin(turn))
                    };
                    let exact: Complex64 = values.iter().enumerate().map(term).fold(Complex64::default(), |a, b| a + b);
                    let error = (found - exact).norm_sqr();
                    assert!(error < 1e-20 * (length * length) as f64, "bin {k} of {length}: {error:e}");
                }
            }
        }
    }

    /// Results that were computed earlier, by other code for the same transforms, keep their bits.
    #[test]
    fn powers_of_two_have_the_bits_of_the_planner() {
        for exponent in 0..15 {
            let length = 1_usize << exponent;
            let values: Vec<Complex64> =
                (0..length).map(|n| Complex64::new(((n * n) % 17) as f64 / 3.0, ((n * 5) % 13) as f64 - 6.0)).collect();
            let mut planner = rustfft::FftPlannerScalar::new();
            let pairs = [
                (forward(length), planner.plan_fft_forward(length)),
                (inverse(length), planner.plan_fft_inverse(length)),
            ];
            for (ours, planned) in pairs {
                let (mut found, mut expected) = (values.clone(), values.clone());
                ours.process(&mut found);
                planned.process(&mut expected);
                assert!(found == expected, "{length}");
            }
        }
    }
}
