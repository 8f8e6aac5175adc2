//! Steady-state covariance of a sampled system's states under white noise at its inputs.

use crate::matrix::Matrix;

/// Doublings after which the sum has converged or never will: 2⁴⁰ ticks.
const MOST: u32 = 40;
/// A term below this fraction of the sum is left out.
const SMALL: f64 = 1e-14;

/// P = A P Aᵀ + B Bᵀ, the steady-state covariance of x⁺ = A x + B w for each of several inputs B, where w is white with
/// unit variance. `inputs` holds one B each, a row per state. Infinite if the system is not stable.
pub fn steady_covariances<const N: usize>(transition: &Matrix, inputs: [&[Vec<f64>]; N]) -> [Matrix; N] {
    let mut sums = inputs.map(of_input);
    let mut power = transition.clone();
    for _ in 0..MOST {
        // P over 2n ticks is P over n ticks plus its propagation over n ticks.
        let transposed = power.transposed();
        let mut converged = true;
        for sum in &mut sums {
            let later = power.times(sum).times(&transposed);
            converged &= largest(&later) <= SMALL * largest(sum);
            sum.add_scaled(1.0, &later);
        }
        if converged {
            return sums;
        }
        power = power.times(&power);
    }
    sums.map(|sum| sum.scaled(f64::INFINITY))
}

/// B Bᵀ.
fn of_input(input: &[Vec<f64>]) -> Matrix {
    let mut product = Matrix::zeros(input.len());
    for (i, row) in input.iter().enumerate() {
        for (j, other) in input.iter().enumerate() {
            product[(i, j)] = row.iter().zip(other).fold(0.0, |sum, (a, b)| sum + a * b);
        }
    }
    product
}

fn largest(matrix: &Matrix) -> f64 {
    (0..matrix.size())
        .flat_map(|row| matrix.row(row))
        .fold(0.0, |most: f64, x| if x.abs() > most { x.abs() } else { most })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_pass_and_a_sum_of_two_inputs() {
        // x⁺ = a x + b w: variance b²/(1 − a²).
        let mut transition = Matrix::zeros(2);
        transition[(0, 0)] = 0.999;
        transition[(1, 0)] = 0.5;
        transition[(1, 1)] = -0.25;
        let [one, other] =
            steady_covariances(&transition, [&[vec![2.0], vec![0.0]], &[vec![0.0, 0.0], vec![3.0, 4.0]]]);
        assert!((one[(0, 0)] / (4.0 / (1.0 - 0.999 * 0.999)) - 1.0).abs() < 1e-9, "{one:?}");
        assert!(one[(1, 1)] > 0.0 && (one[(0, 1)] - one[(1, 0)]).abs() < 1e-9);
        assert!((other[(1, 1)] - 25.0 / (1.0 - 0.0625)).abs() < 1e-9 && other[(0, 0)] == 0.0, "{other:?}");
        // P solves its equation.
        let again = transition.times(&one).times(&transition.transposed());
        assert!((one[(1, 1)] - again[(1, 1)]).abs() < 1e-9 * one[(1, 1)]);
    }

    #[test]
    fn an_unstable_system_has_none() {
        let mut transition = Matrix::zeros(1);
        transition[(0, 0)] = 1.0;
        let [found] = steady_covariances(&transition, [&[vec![1.0]]]);
        assert!(!found[(0, 0)].is_finite());
    }
}
