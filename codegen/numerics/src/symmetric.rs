//! Symmetric eigenproblems by Jacobi rotations, and the modes of M q̈ + K q = 0.

#![allow(clippy::needless_range_loop, reason = "an index names a row of one matrix and a column of another")]

use super::matrix::{Matrix6, multiply6, transpose6};

/// Most sweeps; a 6 × 6 matrix needs fewer than ten, a larger one only a few more.
const SWEEPS: usize = 40;
/// Two ω² with a smaller relative difference count as equal: axes, not rounding, select the vectors that span their
/// space.
const EQUAL: f64 = 1e-9;
/// Shares of an axis with a smaller difference are a tie, which the first axis wins.
const TIE: f64 = 1e-6;

/// Eigenvalues (unordered) and eigenvectors (columns) of a symmetric matrix. Only its upper triangle is used.
pub fn symmetric_eigen(matrix: &Matrix6) -> ([f64; 6], Matrix6) {
    let mut a = *matrix;
    let mut vectors: Matrix6 = core::array::from_fn(|i| core::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for i in 0..6 {
        for j in 0..i {
            a[i][j] = a[j][i];
        }
    }
    diagonalize(&mut a, &mut vectors);
    (core::array::from_fn(|i| a[i][i]), vectors)
}

/// Rotates the symmetric `a` (n rows of n) until it is diagonal: its diagonal is then the eigenvalues, in no order. `vectors` is
/// turned with it; where it was I, its columns become the eigenvectors.
///
/// # Panics
/// If a row of either has fewer than n numbers.
pub fn diagonalize<R: AsRef<[f64]> + AsMut<[f64]>>(a: &mut [R], vectors: &mut [R]) {
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..a.len() {
            for q in p + 1..a.len() {
                let at = |i: usize, j: usize| a[i].as_ref()[j];
                // Off-diagonal entries that no longer change the diagonal count as zero.
                if at(p, q).abs() <= f64::EPSILON * 0.125 * libm::sqrt((at(p, p) * at(q, q)).abs()) {
                    a[p].as_mut()[q] = 0.0;
                    a[q].as_mut()[p] = 0.0;
                    continue;
                }
                rotated = true;
                rotate(a, vectors, p, q);
            }
        }
        if !rotated {
            break;
        }
    }
}

/// The rotation in the plane of p and q that makes a[p][q] zero.
fn rotate<R: AsRef<[f64]> + AsMut<[f64]>>(a: &mut [R], vectors: &mut [R], p: usize, q: usize) {
    let at = |i: usize, j: usize| a[i].as_ref()[j];
    let theta = (at(q, q) - at(p, p)) / (2.0 * at(p, q));
    let root = libm::sqrt(theta * theta + 1.0);
    let t = if theta >= 0.0 { 1.0 / (theta + root) } else { 1.0 / (theta - root) };
    let c = 1.0 / libm::sqrt(t * t + 1.0);
    let s = t * c;
    let turn = |rows: &mut [R]| {
        for row in rows.iter_mut().map(AsMut::as_mut) {
            let (x, y) = (row[p], row[q]);
            row[p] = c * x - s * y;
            row[q] = s * x + c * y;
        }
    };
    turn(a);
    for k in 0..a.len() {
        let (x, y) = (a[p].as_ref()[k], a[q].as_ref()[k]);
        a[p].as_mut()[k] = c * x - s * y;
        a[q].as_mut()[k] = s * x + c * y;
    }
    a[p].as_mut()[q] = 0.0;
    a[q].as_mut()[p] = 0.0;
    turn(vectors);
}

/// L of M = L Lᵀ, if M is positive definite.
fn cholesky(m: &Matrix6) -> Option<Matrix6> {
    let mut l = [[0.0; 6]; 6];
    for i in 0..6 {
        for j in 0..=i {
            let mut sum = m[i][j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            if i == j {
                if !(sum > 0.0 && sum.is_finite()) {
                    return None;
                }
                l[i][i] = libm::sqrt(sum);
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    Some(l)
}

/// L⁻¹ B.
fn solve_lower(l: &Matrix6, b: &Matrix6) -> Matrix6 {
    let mut x = *b;
    for column in 0..6 {
        for i in 0..6 {
            let mut sum = x[i][column];
            for k in 0..i {
                sum -= l[i][k] * x[k][column];
            }
            x[i][column] = sum / l[i][i];
        }
    }
    x
}

/// L⁻ᵀ B.
fn solve_upper(l: &Matrix6, b: &Matrix6) -> Matrix6 {
    let mut x = *b;
    for column in 0..6 {
        for i in (0..6).rev() {
            let mut sum = x[i][column];
            for k in i + 1..6 {
                sum -= l[k][i] * x[k][column];
            }
            x[i][column] = sum / l[i][i];
        }
    }
    x
}

/// ω² in rising order and V (columns) of K v = ω² M v with Vᵀ M V = I; none unless M is positive definite and every number
/// finite.
///
/// V is unique. The vector of a single ω² has a positive M-share of the axis with its largest share. The vectors of
/// equal ω² are projections of axes onto their common space, the axis with the largest share first.
pub fn generalized_modes(stiffness: &Matrix6, mass: &Matrix6) -> Option<([f64; 6], Matrix6)> {
    let l = cholesky(mass)?;
    // L⁻¹ K L⁻ᵀ: K is symmetric, so the second solve works on the transpose of the first.
    let reduced = solve_lower(&l, &transpose6(&solve_lower(&l, stiffness)));
    let (values, vectors) = symmetric_eigen(&reduced);
    if values.iter().chain(vectors.iter().flatten()).any(|x| !x.is_finite()) {
        return None;
    }
    let mut order: [usize; 6] = core::array::from_fn(|i| i);
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let raw = transpose6(&solve_upper(&l, &vectors));
    let sorted: [f64; 6] = order.map(|i| values[i]);
    // Rows of `modes` are the vectors until the end.
    let mut modes = order.map(|i| raw[i]);
    let mut first = 0;
    while first < 6 {
        let mut end = first + 1;
        while end < 6 && sorted[end] - sorted[first] <= EQUAL * sorted[end].abs() {
            end += 1;
        }
        canonical(&mut modes[first..end], mass);
        first = end;
    }
    let mut squares = sorted;
    for (square, mode) in squares.iter_mut().zip(&modes) {
        *square = quadratic(stiffness, mode);
    }
    Some((squares, transpose6(&modes)))
}

/// vᵀ A v.
fn quadratic(a: &Matrix6, v: &[f64; 6]) -> f64 {
    dot(v, &apply(a, v))
}

fn apply(a: &Matrix6, v: &[f64; 6]) -> [f64; 6] {
    a.map(|row| dot(&row, v))
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let mut sum = 0.0;
    for (x, y) in a.iter().zip(b) {
        sum += x * y;
    }
    sum
}

/// Replaces an M-orthonormal set by the one selected by axes.
fn canonical(modes: &mut [[f64; 6]], mass: &Matrix6) {
    let given: Vec<[f64; 6]> = modes.to_vec();
    let mut found: Vec<[f64; 6]> = Vec::with_capacity(given.len());
    for _ in 0..given.len() {
        // Projection of each axis onto the rest of the space; its share is the remaining M-norm.
        let mut best: Option<(f64, [f64; 6])> = None;
        for (axis, row) in mass.iter().enumerate() {
            let mut projection = [0.0; 6];
            for mode in &given {
                add(&mut projection, dot(mode, row), mode);
            }
            for mode in &found {
                let along = dot(mode, &apply(mass, &projection));
                add(&mut projection, -along, mode);
            }
            let share = quadratic(mass, &projection) / mass[axis][axis];
            if best.as_ref().is_none_or(|(largest, _)| share > largest * (1.0 + TIE)) {
                best = Some((share, projection));
            }
        }
        if let Some((_, mut vector)) = best {
            // Twice: the second pass removes the rounding errors of the first.
            for mode in &found {
                let along = dot(mode, &apply(mass, &vector));
                add(&mut vector, -along, mode);
            }
            let norm = libm::sqrt(quadratic(mass, &vector));
            found.push(vector.map(|x| x / norm));
        }
    }
    modes.copy_from_slice(&found);
}

fn add(sum: &mut [f64; 6], factor: f64, v: &[f64; 6]) {
    for (s, x) in sum.iter_mut().zip(v) {
        *s += factor * x;
    }
}

/// Used by tests and by callers that need V⁻¹: it is Vᵀ M.
pub fn inverse_of_modes(modes: &Matrix6, mass: &Matrix6) -> Matrix6 {
    multiply6(&transpose6(modes), mass)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: u64) -> Matrix6 {
        // A small multiplicative generator is sufficient: the matrices need only be general.
        let mut state = seed;
        core::array::from_fn(|_| {
            core::array::from_fn(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
        })
    }

    fn gram(a: &Matrix6, floor: f64) -> Matrix6 {
        let mut product = multiply6(&transpose6(a), a);
        for (i, row) in product.iter_mut().enumerate() {
            row[i] += floor;
        }
        product
    }

    fn largest_difference(a: &Matrix6, b: &Matrix6) -> f64 {
        let apart = a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs());
        // A NaN stays, because no bound accepts it.
        apart.fold(0.0, |largest: f64, apart| if largest.is_nan() || apart <= largest { largest } else { apart })
    }

    #[test]
    fn rotations_diagonalize_a_matrix_of_any_size() {
        let n = 7;
        let m: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| 1.0 / (1.0 + (i + j) as f64) + if i == j { 1.0 } else { 0.0 }).collect())
            .collect();
        let mut v: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let mut a = m.clone();
        diagonalize(&mut a, &mut v);
        for i in 0..n {
            for k in 0..n {
                let left: f64 = (0..n).map(|j| m[i][j] * v[j][k]).sum();
                assert!((left - a[k][k] * v[i][k]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn modes_diagonalise_both_matrices() {
        for seed in 1..20 {
            let mass = gram(&random(seed), 0.1);
            let stiffness = gram(&random(seed + 100), 0.0);
            let (squares, v) = generalized_modes(&stiffness, &mass).unwrap();
            let identity = multiply6(&transpose6(&v), &multiply6(&mass, &v));
            let diagonal = multiply6(&transpose6(&v), &multiply6(&stiffness, &v));
            for i in 0..6 {
                for j in 0..6 {
                    let one = f64::from(u8::from(i == j));
                    assert!((identity[i][j] - one).abs() < 1e-12, "seed {seed}");
                    assert!((diagonal[i][j] - one * squares[i]).abs() < 1e-11, "seed {seed}");
                }
            }
            assert!(squares.windows(2).all(|pair| pair[0] <= pair[1]));
            let inverse = inverse_of_modes(&v, &mass);
            assert!(largest_difference(&multiply6(&inverse, &v), &identity) < 1e-12);
        }
    }

    #[test]
    fn equal_frequencies_have_one_choice_of_vectors() {
        // ω² = 1, 1, 1, 4, 4, 9 in a random M-orthonormal frame; the frame within each space is turned at random.
        let mass = gram(&random(7), 0.2);
        let (_, frame) = generalized_modes(&gram(&random(8), 0.0), &mass).unwrap();
        let squares = [1.0, 1.0, 1.0, 4.0, 4.0, 9.0];
        let build = |frame: &Matrix6| {
            // K = M V Ω² Vᵀ M.
            let scaled: Matrix6 = frame.map(|row| core::array::from_fn(|j| row[j] * squares[j]));
            multiply6(&mass, &multiply6(&multiply6(&scaled, &transpose6(frame)), &mass))
        };
        let mut turned = frame;
        for row in &mut turned {
            let (x, y) = (row[0], row[2]);
            (row[0], row[2]) = (0.6 * x - 0.8 * y, 0.8 * x + 0.6 * y);
            let (x, y) = (row[3], row[4]);
            (row[3], row[4]) = (0.28 * x - 0.96 * y, 0.96 * x + 0.28 * y);
        }
        let (_, one) = generalized_modes(&build(&frame), &mass).unwrap();
        let (_, other) = generalized_modes(&build(&turned), &mass).unwrap();
        assert!(largest_difference(&one, &other) < 1e-9, "{}", largest_difference(&one, &other));
    }

    #[test]
    fn a_mass_matrix_that_is_none_has_no_modes() {
        let mut mass = gram(&random(3), 0.1);
        mass[2][2] = -1.0;
        assert!(generalized_modes(&gram(&random(4), 0.0), &mass).is_none());
        mass[2][2] = f64::NAN;
        assert!(generalized_modes(&gram(&random(4), 0.0), &mass).is_none());
    }
}
