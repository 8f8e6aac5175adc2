//! Non-negative least squares on normal equations: minimise ½ wᵀGw − bᵀw with w ≥ 0.
//!
//! Block principal pivoting (Portugal, Júdice and Vicente 1994; Kim and Park 2011) with a backup rule that makes it
//! finite: when a full exchange of the wrong variables has not reduced their number for a while, only the last one is
//! exchanged. Unlike Lawson–Hanson it starts with all weights free and needs about ten factorisations, whatever the
//! number of weights. It is serial and calls no matrix product that picks instructions at run time, so that the
//! result has the same bits on every host of one architecture.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Full exchanges without progress before the backup rule.
const TRIALS: usize = 3;
/// Relative tolerance of the sign tests, on a problem scaled to unit diagonal.
const TOLERANCE: f64 = 1e-11;

/// Non-negative weights, and how they were found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// w, every entry ≥ 0.
    pub weights: Vec<f64>,
    /// Factorisations that it took.
    pub iterations: usize,
}

/// Why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// G is not positive definite.
    Singular,
    /// The iteration limit was reached.
    Iterations,
}

/// Solves for a symmetric positive definite `gram` (lower triangle used) and `rhs` of the same size.
///
/// # Errors
/// [`Failure::Singular`] if a principal submatrix of `gram` is not positive definite, else see [`Failure`].
pub fn solve(gram: &DMatrix<f64>, rhs: &[f64]) -> Result<Solution, Failure> {
    solve_with(gram, rhs, vec![true; rhs.len()], usize::MAX, TRIALS)
}

/// [`solve`], started with the weights that are zero in `near`, the solution of a similar problem, held at zero. The
/// solution is the same (the problem is strictly convex); it is found in fewer factorisations.
///
/// # Errors
/// As [`solve`].
pub fn solve_from(gram: &DMatrix<f64>, rhs: &[f64], near: &[f64]) -> Result<Solution, Failure> {
    let free = (0..rhs.len()).map(|k| near.get(k).is_none_or(|w| *w > 0.0)).collect();
    solve_with(gram, rhs, free, usize::MAX, TRIALS)
}

/// `fewest` is the number of wrong signs that counts as the best so far: 0 leaves only the backup rule once `trials` is used up.
fn solve_with(
    gram: &DMatrix<f64>,
    rhs: &[f64],
    mut free: Vec<bool>,
    mut fewest: usize,
    trials: usize,
) -> Result<Solution, Failure> {
    let n = rhs.len();
    let mut scale = Vec::with_capacity(n);
    for k in 0..n {
        let diagonal = gram[(k, k)];
        if diagonal.is_nan() || diagonal <= 0.0 {
            return Err(Failure::Singular);
        }
        scale.push(1.0 / diagonal.sqrt());
    }
    let target: Vec<f64> = rhs.iter().zip(&scale).map(|(b, s)| b * s).collect();
    let largest = target.iter().fold(0.0, |m: f64, b| if b.abs() > m { b.abs() } else { m });
    let limit = 5 * n + 50;

    let mut left = trials;
    for iteration in 1..=limit {
        let weights = restricted(gram, &scale, &target, &free)?;
        let wrong = wrong_signs(gram, &scale, &target, &free, &weights, largest);
        let Some(&last) = wrong.last() else {
            let weights = weights.iter().zip(&scale).map(|(w, s)| if *w > 0.0 { w * s } else { 0.0 }).collect();
            return Ok(Solution { weights, iterations: iteration });
        };
        let progress = wrong.len() < fewest;
        if progress {
            fewest = wrong.len();
            left = trials;
        }
        if progress || left > 0 {
            left = if progress { left } else { left - 1 };
            for k in wrong {
                free[k] = !free[k];
            }
        } else {
            free[last] = !free[last];
        }
    }
    Err(Failure::Iterations)
}

/// Minimiser of the scaled problem with the weights outside `free` held at zero.
fn restricted(gram: &DMatrix<f64>, scale: &[f64], target: &[f64], free: &[bool]) -> Result<Vec<f64>, Failure> {
    let chosen: Vec<usize> = (0..free.len()).filter(|&k| free[k]).collect();
    let mut weights = vec![0.0; free.len()];
    let matrix = DMatrix::from_fn(chosen.len(), chosen.len(), |r, c| {
        let (row, column) = (chosen[r], chosen[c]);
        if row >= column { scale[row] * gram[(row, column)] * scale[column] } else { 0.0 }
    });
    let factor = Cholesky::new(matrix).ok_or(Failure::Singular)?;
    let solution = factor.solve(&DVector::from_iterator(chosen.len(), chosen.iter().map(|&k| target[k])));
    for (&k, w) in chosen.iter().zip(solution.iter()) {
        weights[k] = *w;
    }
    Ok(weights)
}

/// Free weights below zero and held ones whose gradient asks for growth, in ascending order.
fn wrong_signs(
    gram: &DMatrix<f64>,
    scale: &[f64],
    target: &[f64],
    free: &[bool],
    weights: &[f64],
    largest: f64,
) -> Vec<usize> {
    let gradient = gradient(gram, scale, target, weights);
    (0..free.len())
        .filter(|&k| if free[k] { weights[k] < -TOLERANCE * largest } else { gradient[k] < -TOLERANCE * largest })
        .collect()
}

fn gradient(gram: &DMatrix<f64>, scale: &[f64], target: &[f64], weights: &[f64]) -> Vec<f64> {
    let n = weights.len();
    let mut gradient: Vec<f64> = target.iter().map(|b| -b).collect();
    for column in (0..n).filter(|&c| weights[c] != 0.0) {
        let w = weights[column] * scale[column];
        for (row, g) in gradient.iter_mut().enumerate() {
            let entry = if row >= column { gram[(row, column)] } else { gram[(column, row)] };
            *g += scale[row] * entry * w;
        }
    }
    gradient
}

/// Largest violation of the Karush–Kuhn–Tucker conditions on the problem scaled to unit diagonal, relative to the
/// largest entry of its right-hand side: w ≥ 0, gradient ≥ 0 where w = 0, gradient = 0 where w > 0.
#[must_use]
pub fn kkt_violation(gram: &DMatrix<f64>, rhs: &[f64], weights: &[f64]) -> f64 {
    let scale: Vec<f64> = (0..rhs.len()).map(|k| 1.0 / gram[(k, k)].sqrt()).collect();
    let target: Vec<f64> = rhs.iter().zip(&scale).map(|(b, s)| b * s).collect();
    let scaled: Vec<f64> = weights.iter().zip(&scale).map(|(w, s)| w / s).collect();
    let largest = target.iter().fold(f64::MIN_POSITIVE, |m: f64, b| if b.abs() > m { b.abs() } else { m });
    let gradient = gradient(gram, &scale, &target, &scaled);
    let worst = scaled.iter().zip(gradient).fold(0.0, |worst: f64, (&w, g)| {
        let violation = if w < 0.0 {
            -w
        } else if w > 0.0 {
            g.abs()
        } else {
            -g
        };
        if violation > worst { violation } else { worst }
    });
    worst / largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    #[test]
    fn the_backup_rule_finds_the_same_solution_in_more_steps() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let n = 40;
        let a = DMatrix::from_fn(n, n, |_, _| uniform() - 0.5);
        let gram = a.transpose() * &a + DMatrix::identity(n, n) * 1e-3;
        let rhs: Vec<f64> = (0..n).map(|_| uniform() - 0.5).collect();
        let full = solve(&gram, &rhs).unwrap();
        let backup = solve_with(&gram, &rhs, vec![true; n], 0, 0).unwrap();
        assert!(backup.iterations > full.iterations, "{} against {}", backup.iterations, full.iterations);
        let near = solve_from(&gram, &rhs, &full.weights).unwrap();
        assert_eq!(near.iterations, 1);
        for (x, y) in near.weights.iter().zip(&full.weights) {
            assert!((x - y).abs() < 1e-12 * (1.0 + x.abs()), "{x} against {y}");
        }
        for (x, y) in full.weights.iter().zip(&backup.weights) {
            assert!((x - y).abs() < 1e-9 * (1.0 + x.abs()), "{x} against {y}");
        }
    }
}
