//! Least squares in which some unknowns are non-negative and the others are free.
//!
//! The free ones are eliminated (Schur complement), the rest is [`nnls`], and the free ones follow. The sums are
//! written out in order: their bits do not depend on the CPU.

use crate::least_squares::dot;
use nalgebra::DMatrix;
use specgen_numerics::Factor;
use specgen_numerics::nnls::{self, Failure};

/// Minimises ½ wᵀGw − bᵀw with the first `bounded` entries of w ≥ 0. `gram` is symmetric, both triangles filled.
pub(crate) fn solve(gram: &DMatrix<f64>, rhs: &[f64], bounded: usize) -> Result<Vec<f64>, Failure> {
    let free = rhs.len() - bounded;
    if free == 0 {
        return nnls::solve(gram, rhs).map(|solution| solution.weights);
    }
    let factor = Factor::of(free, |r, c| gram[(bounded + c, bounded + r)]).ok_or(Failure::Singular)?;
    let solved = |mut values: Vec<f64>| {
        factor.solve(&mut values);
        values
    };
    let free_rhs = solved(rhs[bounded..].to_vec());
    if bounded == 0 {
        return Ok(free_rhs);
    }
    // Column c: response of the free unknowns to bounded unknown c.
    let cross: Vec<Vec<f64>> = (0..bounded).map(|c| (0..free).map(|r| gram[(bounded + r, c)]).collect()).collect();
    let answer: Vec<Vec<f64>> = cross.iter().map(|column| solved(column.clone())).collect();
    let mut reduced = DMatrix::zeros(bounded, bounded);
    for column in 0..bounded {
        for row in column..bounded {
            let value = gram[(row, column)] - dot(&cross[row], &answer[column]);
            reduced[(row, column)] = value;
            reduced[(column, row)] = value;
        }
    }
    let reduced_rhs: Vec<f64> = (0..bounded).map(|k| rhs[k] - dot(&cross[k], &free_rhs)).collect();
    let mut all = nnls::solve(&reduced, &reduced_rhs)?.weights;
    let mut rest = free_rhs;
    for (weight, answer) in all.iter().zip(&answer) {
        rest.iter_mut().zip(answer).for_each(|(rest, answer)| *rest -= answer * weight);
    }
    all.extend(rest);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Karush–Kuhn–Tucker: gradient zero at free and positive entries, not negative at entries held at zero.
    #[test]
    fn the_solution_meets_the_optimality_conditions_and_the_bound_matters() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        let (n, bounded) = (14, 9);
        let a = DMatrix::from_fn(n, n, |_, _| uniform());
        let gram = a.transpose() * &a + DMatrix::identity(n, n) * 1e-2;
        let rhs: Vec<f64> = (0..n).map(|_| uniform()).collect();
        let w = solve(&gram, &rhs, bounded).unwrap();
        let gradient = &gram * DVector::from_column_slice(&w) - DVector::from_column_slice(&rhs);
        for k in 0..n {
            assert!(k >= bounded || w[k] >= 0.0);
            let held = k < bounded && w[k] == 0.0;
            assert!(if held { gradient[k] >= -1e-12 } else { gradient[k].abs() < 1e-12 }, "{k}: {}", gradient[k]);
        }
        assert!(w[..bounded].contains(&0.0) && w[bounded..].iter().any(|x| *x < 0.0), "{w:?}");
        let free = solve(&gram, &rhs, 0).unwrap();
        assert!((&gram * DVector::from_column_slice(&free) - DVector::from_column_slice(&rhs)).amax() < 1e-12);
    }
}
