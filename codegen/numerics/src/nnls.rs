//! Non-negative least squares on normal equations: minimise ½ wᵀGw − bᵀw with w ≥ 0.
//!
//! Block principal pivoting (Portugal, Júdice and Vicente 1994; Kim and Park 2011): all weights start free, and all
//! with the wrong sign change sides at once. That takes about ten factorisations, but may cycle. If their number stops
//! falling, projected Newton steps (Bertsekas 1982) take over: the same factorisation, with a search along the
//! projected line. The objective then falls in every step, and no set of free weights repeats.
//!
//! The free weights are ordered by size, so that those which change sides are at the end and a step refactors little.
//! Every sum has a written order: the result has the same bits on every machine.

use nalgebra::DMatrix;

use crate::cholesky::Factor;

/// Full exchanges without progress before projected Newton steps.
const TRIALS: usize = 3;
/// Relative tolerance of the sign tests, on a problem scaled to unit diagonal.
const TOLERANCE: f64 = 1e-11;
/// Least fraction of the decrease predicted by the gradient with which a projected step is accepted.
const DECREASE: f64 = 1e-4;
/// Halvings of a projected step.
const HALVINGS: usize = 60;
/// The order of the free weights is renewed if less than this fraction of the factor would be kept.
const KEPT: f64 = 0.5;

/// Non-negative weights, and statistics of the solution.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// w, every entry ≥ 0.
    pub weights: Vec<f64>,
    /// Factorisations that it took.
    pub iterations: usize,
}

/// Reason why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// G is not positive definite.
    Singular,
    /// The iteration limit was reached.
    Iterations,
}

/// Solves for a symmetric positive definite `gram` and `rhs` of the same size.
///
/// # Errors
/// [`Failure::Singular`] if a principal submatrix of `gram` is not positive definite; otherwise see [`Failure`].
pub fn solve(gram: &DMatrix<f64>, rhs: &[f64]) -> Result<Solution, Failure> {
    solve_with(gram, rhs, vec![true; rhs.len()], TRIALS)
}

/// [`solve`], started with the weights that are zero in `near`, the solution of a similar problem, held at zero. The
/// solution is the same (the problem is strictly convex), with fewer factorisations.
///
/// # Errors
/// As [`solve`].
pub fn solve_from(gram: &DMatrix<f64>, rhs: &[f64], near: &[f64]) -> Result<Solution, Failure> {
    let free = (0..rhs.len()).map(|k| near.get(k).is_none_or(|w| *w > 0.0)).collect();
    solve_with(gram, rhs, free, TRIALS)
}

fn solve_with(gram: &DMatrix<f64>, rhs: &[f64], mut free: Vec<bool>, trials: usize) -> Result<Solution, Failure> {
    let mut problem = Problem::new(gram, rhs)?;
    let limit = 5 * rhs.len() + 50;
    let (mut fewest, mut left) = (usize::MAX, trials);
    let mut iterations = 0;
    let mut weights = loop {
        iterations += 1;
        let weights = problem.restricted(&free)?;
        let wrong = problem.wrong_signs(&free, &weights, &problem.gradient(&weights));
        if wrong.is_empty() {
            return Ok(problem.solution(&weights, iterations));
        }
        if wrong.len() < fewest && trials > 0 {
            (fewest, left) = (wrong.len(), trials);
        } else if left == 0 {
            break weights;
        } else {
            left -= 1;
        }
        wrong.iter().for_each(|&k| free[k] = !free[k]);
    };
    weights.iter_mut().for_each(|w| *w = positive(*w));
    let mut gradient = problem.gradient(&weights);
    while iterations < limit {
        iterations += 1;
        let tolerance = problem.tolerance;
        let free: Vec<bool> = weights.iter().zip(&gradient).map(|(w, g)| *w > 0.0 || *g < -tolerance).collect();
        let wanted = problem.restricted(&free)?;
        if problem.wrong_signs(&free, &wanted, &problem.gradient(&wanted)).is_empty() {
            return Ok(problem.solution(&wanted, iterations));
        }
        let found = shares().find_map(|share| {
            let next: Vec<f64> = weights.iter().zip(&wanted).map(|(w, z)| positive(w + share * (z - w))).collect();
            let slope = problem.gradient(&next);
            // Exact for a quadratic, and without the cancellation of a difference of objectives.
            let (mut promised, mut change) = (0.0, 0.0);
            for (((w, z), g), h) in weights.iter().zip(&next).zip(&gradient).zip(&slope) {
                promised += g * (z - w);
                change += 0.5 * (g + h) * (z - w);
            }
            (change < DECREASE * promised).then_some((next, slope))
        });
        let Some(found) = found else { break };
        (weights, gradient) = found;
    }
    Err(Failure::Iterations)
}

/// Fractions of a step that are tried: all of it, then halves.
fn shares() -> impl Iterator<Item = f64> {
    core::iter::successors(Some(1.0), |share| Some(0.5 * share)).take(HALVINGS)
}

fn positive(w: f64) -> f64 {
    if w > 0.0 { w } else { 0.0 }
}

/// The problem scaled to unit diagonal, and the factor of its last restriction.
struct Problem<'a> {
    gram: &'a DMatrix<f64>,
    scale: Vec<f64>,
    target: Vec<f64>,
    /// Of weights and gradients.
    tolerance: f64,
    factor: Factor,
    /// Weights in the factor, in its order.
    order: Vec<usize>,
    /// The last restricted weights.
    last: Vec<f64>,
}

impl<'a> Problem<'a> {
    fn new(gram: &'a DMatrix<f64>, rhs: &[f64]) -> Result<Self, Failure> {
        let mut scale = Vec::with_capacity(rhs.len());
        for k in 0..rhs.len() {
            let diagonal = gram[(k, k)];
            if diagonal.is_nan() || diagonal <= 0.0 {
                return Err(Failure::Singular);
            }
            scale.push(1.0 / diagonal.sqrt());
        }
        let target: Vec<f64> = rhs.iter().zip(&scale).map(|(b, s)| b * s).collect();
        let largest = target.iter().fold(0.0, |m: f64, b| if b.abs() > m { b.abs() } else { m });
        let (factor, order, last) = (Factor::new(rhs.len()), Vec::new(), vec![0.0; rhs.len()]);
        Ok(Self { gram, scale, target, tolerance: TOLERANCE * largest, factor, order, last })
    }

    /// Minimiser of the scaled problem with the weights outside `free` held at zero.
    fn restricted(&mut self, free: &[bool]) -> Result<Vec<f64>, Failure> {
        let mut kept = self.order.iter().take_while(|k| free[**k]).count();
        let mut placed = vec![false; free.len()];
        self.order.retain(|&k| free[k]);
        self.order.iter().for_each(|&k| placed[k] = true);
        self.order.extend((0..free.len()).filter(|&k| free[k] && !placed[k]));
        if (kept as f64) < KEPT * self.order.len() as f64 {
            kept = 0;
            let last = &self.last;
            self.order.sort_by(|&a, &b| last[b].total_cmp(&last[a]).then(a.cmp(&b)));
        }
        let (order, scale, gram) = (&self.order, &self.scale, self.gram);
        let entry = |row: usize, column: usize| {
            let (a, b) = (order[row], order[column]);
            scale[a] * gram[(b, a)] * scale[b]
        };
        if !self.factor.set(kept, order.len(), entry) {
            return Err(Failure::Singular);
        }
        let mut values: Vec<f64> = order.iter().map(|&k| self.target[k]).collect();
        self.factor.solve(&mut values);
        self.last.fill(0.0);
        order.iter().zip(values).for_each(|(&k, w)| self.last[k] = w);
        Ok(self.last.clone())
    }

    /// Free weights below zero, and held ones whose gradient demands growth, in ascending order.
    fn wrong_signs(&self, free: &[bool], weights: &[f64], gradient: &[f64]) -> Vec<usize> {
        let wrong = |&k: &usize| (if free[k] { weights[k] } else { gradient[k] }) < -self.tolerance;
        (0..free.len()).filter(wrong).collect()
    }

    fn gradient(&self, weights: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; weights.len()];
        for (column, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            let w = w * self.scale[column];
            product.iter_mut().zip(self.gram.column(column).iter()).for_each(|(sum, entry)| *sum += entry * w);
        }
        product.iter().zip(&self.scale).zip(&self.target).map(|((sum, s), b)| s * sum - b).collect()
    }

    fn solution(&self, weights: &[f64], iterations: usize) -> Solution {
        Solution { weights: weights.iter().zip(&self.scale).map(|(w, s)| positive(*w) * s).collect(), iterations }
    }
}

/// Largest violation of the Karush–Kuhn–Tucker conditions on the problem scaled to unit diagonal, relative to the
/// largest entry of its right-hand side: w ≥ 0, gradient ≥ 0 where w = 0, gradient = 0 where w > 0.
pub fn kkt_violation(gram: &DMatrix<f64>, rhs: &[f64], weights: &[f64]) -> f64 {
    let Ok(problem) = Problem::new(gram, rhs) else { return f64::INFINITY };
    let scaled: Vec<f64> = weights.iter().zip(&problem.scale).map(|(w, s)| w / s).collect();
    let largest = problem.target.iter().fold(f64::MIN_POSITIVE, |m: f64, b| if b.abs() > m { b.abs() } else { m });
    let gradient = problem.gradient(&scaled);
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
    use nalgebra::DVector;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Lawson and Hanson's published algorithm: an independent program for the same problem.
    fn lawson_hanson(gram: &DMatrix<f64>, rhs: &[f64]) -> Vec<f64> {
        let n = rhs.len();
        let (mut x, mut passive) = (vec![0.0; n], Vec::<usize>::new());
        loop {
            let slope = |k: usize, x: &[f64]| rhs[k] - (0..n).fold(0.0, |sum, other| sum + gram[(k, other)] * x[other]);
            let held = (0..n).filter(|k| !passive.contains(k));
            let steepest = held.max_by(|&a, &b| slope(a, &x).total_cmp(&slope(b, &x)));
            let Some(k) = steepest.filter(|&k| slope(k, &x) > 1e-12) else { return x };
            passive.push(k);
            loop {
                let block = DMatrix::from_fn(passive.len(), passive.len(), |r, c| gram[(passive[r], passive[c])]);
                let z =
                    block.lu().solve(&DVector::from_iterator(passive.len(), passive.iter().map(|&k| rhs[k]))).unwrap();
                let blocking = passive.iter().zip(z.iter()).filter(|(_, z)| **z <= 0.0);
                let share = blocking.map(|(&k, z)| x[k] / (x[k] - z)).fold(1.0, |a: f64, b| if b < a { b } else { a });
                passive.iter().zip(z.iter()).for_each(|(&k, z)| x[k] += share * (z - x[k]));
                if share >= 1.0 {
                    break;
                }
                passive.iter().for_each(|&k| x[k] = if x[k] > 1e-13 { x[k] } else { 0.0 });
                passive.retain(|&k| x[k] > 0.0);
            }
        }
    }

    /// Regular problems, and problems whose columns are sums of one another, as those of a table are.
    fn problems() -> impl Iterator<Item = (DMatrix<f64>, Vec<f64>)> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut uniform = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        (0..12).map(move |case| {
            let n = 10 + 10 * case;
            let mut a = DMatrix::from_fn(n, n, |_, _| uniform());
            if case % 2 == 1 {
                for column in 1..n {
                    let sum = a.column(column) * 0.3 + a.column(column - 1);
                    a.set_column(column, &sum);
                }
            }
            let gram = a.transpose() * &a + DMatrix::identity(n, n) * 1e-3;
            (gram, (0..n).map(|_| uniform()).collect())
        })
    }

    #[test]
    fn both_ways_find_what_lawson_and_hanson_do_with_a_certificate() {
        for (gram, rhs) in problems() {
            let n = rhs.len();
            let wanted = lawson_hanson(&gram, &rhs);
            let exchanged = solve(&gram, &rhs).unwrap();
            let projected = solve_with(&gram, &rhs, vec![true; n], 0).unwrap();
            assert!(exchanged.weights.contains(&0.0) && projected.iterations > 1);
            let near = solve_from(&gram, &rhs, &exchanged.weights).unwrap();
            assert_eq!(near.iterations, 1);
            for found in [&exchanged, &projected, &near] {
                assert!(kkt_violation(&gram, &rhs, &found.weights) < 1e-10);
                for (x, w) in found.weights.iter().zip(&wanted) {
                    assert!((x - w).abs() < 1e-9 * (1.0 + w.abs()), "{n}: {x} against {w}");
                }
            }
            // With another weight at zero it is not a solution, and the certificate shows it.
            let mut wrong = exchanged.weights;
            *wrong.iter_mut().find(|w| **w > 1e-3).unwrap() = 0.0;
            assert!(kkt_violation(&gram, &rhs, &wrong) > 1e-6);
        }
    }
}
