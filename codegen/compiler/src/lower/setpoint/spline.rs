//! Cubic splines through equidistant rows: twice continuously differentiable, so that rate and acceleration are analytic.
//!
//! With m = M h²/6 (M second derivative, h row time) the spline's equations are m₋ + 4 m + m₊ = y₋ − 2 y + y₊ at inner rows.
//! A table that runs once starts and ends at rest: 2 m₀ + m₁ = y₁ − y₀ and likewise at the end. A repeated one is periodic.

/// m of every row of one axis; at least two rows.
pub(super) fn at_rest(y: &[f64]) -> Vec<f64> {
    let n = y.len();
    let right: Vec<f64> = (0..n)
        .map(|k| match k {
            0 => y[1] - y[0],
            k if k + 1 == n => y[n - 2] - y[n - 1],
            k => (y[k - 1] - y[k]) + (y[k + 1] - y[k]),
        })
        .collect();
    let mut diagonal = vec![4.0; n];
    diagonal[0] = 2.0;
    diagonal[n - 1] = 2.0;
    tridiagonal(&diagonal, right)
}

/// m of every row of one axis whose last row is followed by the first; at least two rows.
pub(super) fn closed(y: &[f64]) -> Vec<f64> {
    let n = y.len();
    let right: Vec<f64> = (0..n).map(|k| (y[(k + n - 1) % n] - y[k]) + (y[(k + 1) % n] - y[k])).collect();
    if n == 2 {
        // Both neighbours are the same row: 4 m₀ + 2 m₁.
        let [a, b] = [right[0], right[1]];
        return vec![(4.0 * a - 2.0 * b) / 12.0, (4.0 * b - 2.0 * a) / 12.0];
    }
    // The corner entries are a rank-one update u uᵀ (Sherman and Morrison) with u = (1, 0, …, 0, 1).
    let mut diagonal = vec![4.0; n];
    diagonal[0] = 3.0;
    diagonal[n - 1] = 3.0;
    let mut u = vec![0.0; n];
    u[0] = 1.0;
    u[n - 1] = 1.0;
    let (plain, corner) = (tridiagonal(&diagonal, right), tridiagonal(&diagonal, u));
    let factor = (plain[0] + plain[n - 1]) / (1.0 + corner[0] + corner[n - 1]);
    plain.iter().zip(&corner).map(|(plain, corner)| plain - factor * corner).collect()
}

/// Solves a tridiagonal system with `diagonal` and ones beside it; diagonally dominant, so without pivoting.
fn tridiagonal(diagonal: &[f64], mut right: Vec<f64>) -> Vec<f64> {
    let n = diagonal.len();
    let mut pivot = diagonal.to_vec();
    for k in 1..n {
        let factor = 1.0 / pivot[k - 1];
        pivot[k] -= factor;
        right[k] -= factor * right[k - 1];
    }
    right[n - 1] /= pivot[n - 1];
    for k in (0..n - 1).rev() {
        right[k] = (right[k] - right[k + 1]) / pivot[k];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(n: usize) -> Vec<f64> {
        let mut state = 5_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        (0..n).map(|_| next()).collect()
    }

    #[test]
    fn a_spline_at_rest_solves_its_equations() {
        for n in [2, 3, 4, 17, 500] {
            let y = rows(n);
            let m = at_rest(&y);
            assert!((2.0 * m[0] + m[1] - (y[1] - y[0])).abs() < 1e-14);
            assert!((2.0 * m[n - 1] + m[n - 2] - (y[n - 2] - y[n - 1])).abs() < 1e-14);
            for k in 1..n - 1 {
                assert!((m[k - 1] + 4.0 * m[k] + m[k + 1] - (y[k - 1] - 2.0 * y[k] + y[k + 1])).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_closed_spline_solves_its_equations_all_round() {
        for n in [2, 3, 4, 17, 500] {
            let y = rows(n);
            let m = closed(&y);
            for k in 0..n {
                let (before, after) = ((k + n - 1) % n, (k + 1) % n);
                let residual = m[before] + 4.0 * m[k] + m[after] - (y[before] - 2.0 * y[k] + y[after]);
                assert!(residual.abs() < 1e-14, "{n} {k} {residual:e}");
            }
        }
    }
}
