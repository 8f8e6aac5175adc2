//! Eigenvalues of a real matrix: balancing, reduction to Hessenberg form, Francis' double shift QR (EISPACK's `balanc`,
//! `elmhes`, `hqr`).

use super::matrix::Matrix;

/// QR steps allowed for one eigenvalue; it usually takes two or three.
const STEPS: u32 = 60;

/// All eigenvalues as (real, imaginary), in the order they were deflated; none if an entry is not finite or the iteration
/// does not converge.
pub fn eigenvalues(matrix: &Matrix) -> Option<Vec<(f64, f64)>> {
    let mut found = Vec::with_capacity(matrix.size());
    for block in matrix.blocks() {
        let mut part = matrix.restricted(&block);
        if !part.row_norm().is_finite() {
            return None;
        }
        balance(&mut part);
        reduce(&mut part);
        deflate(&mut part, &mut found)?;
    }
    Some(found)
}

/// Scales rows and columns by powers of two until their norms are similar.
fn balance(a: &mut Matrix) {
    let n = a.size();
    // The iteration always ends; the bound states it.
    for _ in 0..100 {
        let mut done = true;
        for i in 0..n {
            let (mut column, mut row) = (0.0, 0.0);
            for j in 0..n {
                if j != i {
                    column += a[(j, i)].abs();
                    row += a[(i, j)].abs();
                }
            }
            if column == 0.0 || row == 0.0 {
                continue;
            }
            let sum = column + row;
            let mut factor = 1.0;
            while column < row / 2.0 {
                factor *= 2.0;
                column *= 4.0;
            }
            while column >= row * 2.0 {
                factor /= 2.0;
                column /= 4.0;
            }
            if (column + row) / factor < 0.95 * sum {
                done = false;
                for j in 0..n {
                    a[(i, j)] /= factor;
                }
                for j in 0..n {
                    a[(j, i)] *= factor;
                }
            }
        }
        if done {
            return;
        }
    }
}

/// Largest magnitude of an eigenvalue; infinite if they cannot be computed, NaN if one of them is NaN.
pub fn spectral_radius(matrix: &Matrix) -> f64 {
    let Some(values) = eigenvalues(matrix) else {
        return f64::INFINITY;
    };
    let mut largest = 0.0;
    for (re, im) in values {
        let magnitude = libm::hypot(re, im);
        if magnitude > largest || magnitude.is_nan() {
            largest = magnitude;
        }
    }
    largest
}

/// Similar matrix with zeros below the first subdiagonal, by elimination with row pivots. Returns the steps: for the
/// k-th, the row that was exchanged with row k + 1, and the factors of that row in the ones below.
pub(crate) fn reduce(a: &mut Matrix) -> Vec<(usize, Vec<f64>)> {
    let n = a.size();
    let mut steps = Vec::with_capacity(n.saturating_sub(2));
    for m in 1..n.saturating_sub(1) {
        let mut pivot = m;
        for i in m..n {
            if a[(i, m - 1)].abs() > a[(pivot, m - 1)].abs() {
                pivot = i;
            }
        }
        if pivot != m {
            for j in 0..n {
                let swap = a[(pivot, j)];
                a[(pivot, j)] = a[(m, j)];
                a[(m, j)] = swap;
            }
            for j in 0..n {
                let swap = a[(j, pivot)];
                a[(j, pivot)] = a[(j, m)];
                a[(j, m)] = swap;
            }
        }
        let leading = a[(m, m - 1)];
        let mut factors = vec![0.0; n - m - 1];
        for (i, kept) in (m + 1..n).zip(&mut factors) {
            if leading == 0.0 {
                break;
            }
            let factor = a[(i, m - 1)] / leading;
            if factor == 0.0 {
                continue;
            }
            *kept = factor;
            a[(i, m - 1)] = 0.0;
            for j in m..n {
                let x = a[(m, j)];
                a[(i, j)] -= factor * x;
            }
            for j in 0..n {
                let x = a[(j, i)];
                a[(j, m)] += factor * x;
            }
        }
        steps.push((pivot, factors));
    }
    steps
}

/// Eigenvalues of a Hessenberg matrix, from its lower end.
fn deflate(a: &mut Matrix, found: &mut Vec<(f64, f64)>) -> Option<()> {
    let norm = a.row_norm();
    let mut end = a.size();
    let mut shifted = 0.0;
    let mut steps = 0;
    while end > 0 {
        let last = end - 1;
        let start = small_subdiagonal(a, last, norm);
        let x = a[(last, last)];
        if start == last {
            found.push((x + shifted, 0.0));
            end -= 1;
            steps = 0;
            continue;
        }
        let y = a[(last - 1, last - 1)];
        let w = a[(last, last - 1)] * a[(last - 1, last)];
        if start == last - 1 {
            push_pair(found, [x, y, w], shifted);
            end -= 2;
            steps = 0;
            continue;
        }
        if steps == STEPS {
            return None;
        }
        let mut shift = [x, y, w];
        if steps % 10 == 9 {
            // An exceptional shift breaks a cycle.
            shifted += x;
            for i in 0..=last {
                a[(i, i)] -= x;
            }
            let s = a[(last, last - 1)].abs() + a[(last - 1, last - 2)].abs();
            shift = [0.75 * s, 0.75 * s, -0.4375 * s * s];
        }
        steps += 1;
        double_step(a, start, last, shift);
    }
    Some(())
}

/// Row of the first entry of the unreduced block that ends at `last`.
fn small_subdiagonal(a: &mut Matrix, last: usize, norm: f64) -> usize {
    for l in (1..=last).rev() {
        let mut scale = a[(l - 1, l - 1)].abs() + a[(l, l)].abs();
        if scale == 0.0 {
            scale = norm;
        }
        if a[(l, l - 1)].abs() <= f64::EPSILON * scale {
            a[(l, l - 1)] = 0.0;
            return l;
        }
    }
    0
}

/// Eigenvalues of the last 2 × 2 block.
fn push_pair(found: &mut Vec<(f64, f64)>, [x, y, w]: [f64; 3], shifted: f64) {
    let p = 0.5 * (y - x);
    let q = p * p + w;
    let z = libm::sqrt(q.abs());
    let x = x + shifted;
    if q >= 0.0 {
        let z = if p >= 0.0 { p + z } else { p - z };
        found.push((x + z, 0.0));
        found.push((if z == 0.0 { x } else { x - w / z }, 0.0));
    } else {
        found.push((x + p, z));
        found.push((x + p, -z));
    }
}

/// One double QR step on rows `start` to `last`.
fn double_step(a: &mut Matrix, start: usize, last: usize, [x, y, w]: [f64; 3]) {
    let n = a.size();
    // Two consecutive small subdiagonal entries allow the step to begin below `start`.
    let mut m = last - 2;
    let (mut p, mut q, mut r);
    loop {
        let z = a[(m, m)];
        let (rr, ss) = (x - z, y - z);
        p = (rr * ss - w) / a[(m + 1, m)] + a[(m, m + 1)];
        q = a[(m + 1, m + 1)] - z - rr - ss;
        r = a[(m + 2, m + 1)];
        let scale = p.abs() + q.abs() + r.abs();
        p /= scale;
        q /= scale;
        r /= scale;
        if m == start {
            break;
        }
        let u = a[(m, m - 1)].abs() * (q.abs() + r.abs());
        let v = p.abs() * (a[(m - 1, m - 1)].abs() + z.abs() + a[(m + 1, m + 1)].abs());
        if u <= f64::EPSILON * v {
            break;
        }
        m -= 1;
    }
    for i in m + 2..=last {
        a[(i, i - 2)] = 0.0;
        if i > m + 2 {
            a[(i, i - 3)] = 0.0;
        }
    }
    for k in m..last {
        let three = k + 1 < last;
        let mut x = 0.0;
        if k != m {
            p = a[(k, k - 1)];
            q = a[(k + 1, k - 1)];
            r = if three { a[(k + 2, k - 1)] } else { 0.0 };
            x = p.abs() + q.abs() + r.abs();
            if x == 0.0 {
                continue;
            }
            p /= x;
            q /= x;
            r /= x;
        }
        let norm = libm::sqrt(p * p + q * q + r * r);
        let s = if p >= 0.0 { norm } else { -norm };
        if s == 0.0 {
            continue;
        }
        if k != m {
            a[(k, k - 1)] = -s * x;
        } else if start != m {
            a[(k, k - 1)] = -a[(k, k - 1)];
        }
        p += s;
        let (hx, hy, hz) = (p / s, q / s, r / s);
        q /= p;
        r /= p;
        for j in k..n {
            let mut sum = a[(k, j)] + q * a[(k + 1, j)];
            if three {
                sum += r * a[(k + 2, j)];
                a[(k + 2, j)] -= sum * hz;
            }
            a[(k + 1, j)] -= sum * hy;
            a[(k, j)] -= sum * hx;
        }
        let lowest = if k + 3 < last { k + 3 } else { last };
        for i in 0..=lowest {
            let mut sum = hx * a[(i, k)] + hy * a[(i, k + 1)];
            if three {
                sum += hz * a[(i, k + 2)];
                a[(i, k + 2)] -= sum * r;
            }
            a[(i, k + 1)] -= sum * q;
            a[(i, k)] -= sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(size: usize, seed: u64) -> Matrix {
        let mut state = seed;
        let mut matrix = Matrix::zeros(size);
        for i in 0..size {
            for j in 0..size {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                matrix[(i, j)] = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            }
        }
        matrix
    }

    /// Largest distance of a value of one set from the nearest of the other.
    fn distance(found: &[(f64, f64)], expected: &[(f64, f64)]) -> f64 {
        let nearest =
            |(a, b): (f64, f64)| expected.iter().map(|(c, d)| libm::hypot(a - c, b - d)).fold(f64::INFINITY, f64::min);
        found.iter().map(|&value| nearest(value)).fold(0.0, f64::max)
    }

    #[test]
    fn eigenvalues_agree_with_nalgebra() {
        for (size, seed) in [(1, 1), (2, 2), (3, 3), (7, 4), (20, 5), (45, 6), (78, 7)] {
            let matrix = random(size, seed);
            let found = eigenvalues(&matrix).unwrap();
            let other = nalgebra::DMatrix::from_fn(size, size, |i, j| matrix[(i, j)]).complex_eigenvalues();
            let expected: Vec<(f64, f64)> = other.iter().map(|value| (value.re, value.im)).collect();
            assert_eq!(found.len(), size);
            let apart = distance(&found, &expected).max(distance(&expected, &found));
            assert!(apart < 1e-11, "size {size}: {apart:e}");
        }
    }

    #[test]
    fn a_companion_matrix_has_the_roots_of_its_polynomial() {
        // (z − 1)(z − 2)…(z − 8), badly scaled: balancing is needed.
        let mut coefficients = vec![1.0];
        for root in 1..=8 {
            let mut next = coefficients.clone();
            next.push(0.0);
            for (k, c) in coefficients.iter().enumerate() {
                next[k + 1] -= f64::from(root) * c;
            }
            coefficients = next;
        }
        let mut matrix = Matrix::zeros(8);
        for k in 0..8 {
            matrix[(0, k)] = -coefficients[k + 1] * libm::pow(1e6, k as f64);
            if k > 0 {
                matrix[(k, k - 1)] = 1e-6;
            }
        }
        let expected: Vec<(f64, f64)> = (1..=8).map(|root| (f64::from(root), 0.0)).collect();
        let found = eigenvalues(&matrix).unwrap();
        assert!(distance(&found, &expected) < 1e-7 && distance(&expected, &found) < 1e-7, "{found:?}");
    }

    #[test]
    fn a_matrix_that_is_not_finite_has_no_eigenvalues() {
        let mut matrix = random(5, 9);
        matrix[(2, 3)] = f64::NAN;
        assert!(eigenvalues(&matrix).is_none());
        assert_eq!(eigenvalues(&Matrix::zeros(4)).unwrap(), [(0.0, 0.0); 4]);
    }
}
