//! Matrix exponential by scaling, a Taylor series and squaring.

use super::matrix::Matrix;

/// Terms of the series: 0.5²⁰/20! is far below the rounding of a double.
const TERMS: u32 = 19;
/// Most squarings: a norm of 2⁶⁰ is not a sampled system.
const LARGEST_EXPONENT: u32 = 60;

/// e^A. Entries are finite for any A whose norm is below 2⁶⁰ and whose exponential is finite.
pub fn exponential(matrix: &Matrix) -> Matrix {
    let mut squarings = 0;
    let mut norm = matrix.row_norm();
    while norm > 0.5 && squarings < LARGEST_EXPONENT {
        norm *= 0.5;
        squarings += 1;
    }
    let scaled = matrix.scaled(libm::ldexp(1.0, -(squarings as i32)));
    // Horner: I + A (I + A/2 (I + A/3 (…))).
    let mut sum = Matrix::identity(matrix.size());
    for k in (1..=TERMS).rev() {
        let mut next = Matrix::identity(matrix.size());
        next.add_scaled(1.0 / f64::from(k), &scaled.times(&sum));
        sum = next;
    }
    for _ in 0..squarings {
        sum = sum.times(&sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_and_a_decay_come_out_as_sine_cosine_and_exponential() {
        for (angle, rate) in [(0.3_f64, 0.1_f64), (2.0, 3.0), (40.0, 700.0)] {
            let mut matrix = Matrix::zeros(3);
            matrix[(0, 1)] = -angle;
            matrix[(1, 0)] = angle;
            matrix[(2, 2)] = -rate;
            let e = exponential(&matrix);
            let tolerance = 1e-14 * angle.max(1.0);
            assert!(
                (e[(0, 0)] - libm::cos(angle)).abs() < tolerance && (e[(1, 0)] - libm::sin(angle)).abs() < tolerance
            );
            assert!((e[(2, 2)] - libm::exp(-rate)).abs() < 1e-15 * rate.max(1.0));
            assert_eq!((e[(0, 2)], e[(2, 1)]), (0.0, 0.0), "what does not couple stays apart");
        }
    }
}
