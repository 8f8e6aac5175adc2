//! Small dense linear algebra in written order, so that a plant has the same bits on every host.

/// Six numbers: pose coordinates, generalised forces, or one number per leg.
pub type Six = [f64; 6];

/// Rows of a 6×6 matrix.
pub type Matrix6 = [[f64; 6]; 6];

/// Three numbers: a vector of space.
pub type Three = [f64; 3];

/// Rows of a 3×3 matrix.
pub type Matrix3 = [[f64; 3]; 3];

/// Lanes: six legs, and two idle ones, to fill vector registers.
pub(crate) const LANES: usize = 8;

/// A number of each leg.
pub(crate) type Lane = [f64; LANES];

/// A number of each leg, and 0 in the idle lanes.
pub(crate) fn lanes_of(&[a, b, c, d, e, f]: &Six) -> Lane {
    [a, b, c, d, e, f, 0.0, 0.0]
}

/// `a` × `b`.
pub(crate) fn cross(a: Three, b: Three) -> Three {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a` · `b`.
pub(crate) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for k in 0..N {
        sum += a[k] * b[k];
    }
    sum
}

/// `matrix` · `vector`.
pub(crate) fn apply<const R: usize, const C: usize>(matrix: &[[f64; C]; R], vector: &[f64; C]) -> [f64; R] {
    std::array::from_fn(|row| dot(&matrix[row], vector))
}

/// `matrix`ᵀ · `vector`.
pub(crate) fn apply_transposed<const R: usize, const C: usize>(matrix: &[[f64; C]; R], vector: &[f64; R]) -> [f64; C] {
    let mut out = [0.0; C];
    for row in 0..R {
        for column in 0..C {
            out[column] += matrix[row][column] * vector[row];
        }
    }
    out
}

/// `a` · `b`.
pub(crate) fn product<const R: usize, const K: usize, const C: usize>(
    a: &[[f64; K]; R],
    b: &[[f64; C]; K],
) -> [[f64; C]; R] {
    let mut out = [[0.0; C]; R];
    for row in 0..R {
        for k in 0..K {
            for column in 0..C {
                out[row][column] += a[row][k] * b[k][column];
            }
        }
    }
    out
}

/// Adds Aᵀ · diag(weights) · A to `sum`.
pub(crate) fn add_congruent<const R: usize>(sum: &mut Matrix6, a: &[[f64; 6]; R], weights: &[f64; R]) {
    for row in 0..R {
        for i in 0..6 {
            for j in 0..6 {
                sum[i][j] += a[row][i] * weights[row] * a[row][j];
            }
        }
    }
}

/// Aᵀ · diag(weights) · A.
pub(crate) fn congruent<const R: usize>(a: &[[f64; 6]; R], weights: &[f64; R]) -> Matrix6 {
    let mut sum = [[0.0; 6]; 6];
    add_congruent(&mut sum, a, weights);
    sum
}

/// Transposed matrix.
pub(crate) fn transposed<const R: usize, const C: usize>(matrix: &[[f64; C]; R]) -> [[f64; R]; C] {
    std::array::from_fn(|column| std::array::from_fn(|row| matrix[row][column]))
}

/// Solves A X = B by Gauss elimination with row pivoting. A singular A gives numbers that are not finite.
pub(crate) fn solve<const C: usize>(a: &Matrix6, b: &[[f64; C]; 6]) -> [[f64; C]; 6] {
    let (mut a, mut b) = (*a, *b);
    for step in 0..6 {
        let mut pivot = step;
        for row in step + 1..6 {
            if a[row][step].abs() > a[pivot][step].abs() {
                pivot = row;
            }
        }
        a.swap(step, pivot);
        b.swap(step, pivot);
        for row in step + 1..6 {
            let factor = a[row][step] / a[step][step];
            for column in step..6 {
                a[row][column] -= factor * a[step][column];
            }
            for column in 0..C {
                b[row][column] -= factor * b[step][column];
            }
        }
    }
    for step in (0..6).rev() {
        for column in 0..C {
            let mut sum = b[step][column];
            for k in step + 1..6 {
                sum -= a[step][k] * b[k][column];
            }
            b[step][column] = sum / a[step][step];
        }
    }
    b
}

/// Identity.
pub(crate) const IDENTITY6: Matrix6 = {
    let mut out = [[0.0; 6]; 6];
    let mut k = 0;
    while k < 6 {
        out[k][k] = 1.0;
        k += 1;
    }
    out
};

/// Inverse of A.
pub(crate) fn inverse(a: &Matrix6) -> Matrix6 {
    solve(a, &IDENTITY6)
}

/// e^A of an N×N matrix given as rows: Taylor series of A/2^s with |A/2^s| ≤ 1/4, squared s times.
pub fn exponential(matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = matrix.len();
    let multiply = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        let mut out = vec![vec![0.0; n]; n];
        for row in 0..n {
            for k in 0..n {
                let factor = a[row][k];
                for column in 0..n {
                    out[row][column] += factor * b[k][column];
                }
            }
        }
        out
    };
    let norm = matrix.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let mut halvings = 0;
    let mut scale = 1.0;
    while norm * scale > 0.25 && halvings < 200 {
        scale *= 0.5;
        halvings += 1;
    }
    let scaled: Vec<Vec<f64>> = matrix.iter().map(|row| row.iter().map(|x| x * scale).collect()).collect();
    let identity = |row: usize, column: usize| if row == column { 1.0 } else { 0.0 };
    let mut out: Vec<Vec<f64>> = (0..n).map(|row| (0..n).map(|column| identity(row, column)).collect()).collect();
    // Horner from the 14th power: the next term is below 1e-21 of the sum.
    for power in (1..=14).rev() {
        out = multiply(&scaled, &out);
        for (row, values) in out.iter_mut().enumerate() {
            for (column, value) in values.iter_mut().enumerate() {
                *value = *value / f64::from(power) + identity(row, column);
            }
        }
    }
    for _ in 0..halvings {
        out = multiply(&out, &out);
    }
    out
}

/// Solutions of K v = λ M v for symmetric K and symmetric positive definite M: λ in rising order, and vectors with
/// vᵀ M v = 1 as columns of the matrix.
///
/// Cholesky factor of M, then Jacobi rotations.
pub(crate) fn generalised_eigen(stiffness: &Matrix6, mass: &Matrix6) -> (Six, Matrix6) {
    let mut lower = [[0.0; 6]; 6];
    for row in 0..6 {
        for column in 0..=row {
            let mut sum = mass[row][column];
            for k in 0..column {
                sum -= lower[row][k] * lower[column][k];
            }
            lower[row][column] = if row == column { libm::sqrt(sum) } else { sum / lower[column][column] };
        }
    }
    // A = L⁻¹ K L⁻ᵀ.
    let half = solve(&lower, stiffness);
    let mut a = solve(&lower, &transposed(&half));
    let mut vectors = IDENTITY6;
    for _sweep in 0..60 {
        for p in 0..6 {
            for q in p + 1..6 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let sign = if theta >= 0.0 { 1.0 } else { -1.0 };
                let t = sign / (theta.abs() + libm::sqrt(theta * theta + 1.0));
                let c = 1.0 / libm::sqrt(t * t + 1.0);
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                for k in 0..6 {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                }
                for row in &mut vectors {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    let shapes = solve(&transposed(&lower), &vectors);
    let mut order = [0, 1, 2, 3, 4, 5];
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]));
    (order.map(|k| a[k][k]), shapes.map(|row| order.map(|k| row[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Matrix6 {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| libm::sin((3 * i + 7 * j) as f64) + if i == j { 4.0 } else { 0.0 })
        })
    }

    #[test]
    fn a_solution_solves_though_the_first_pivot_is_zero() {
        let mut a = sample();
        a[0][0] = 0.0;
        let x = inverse(&a);
        let one = product(&a, &x);
        for row in 0..6 {
            for column in 0..6 {
                assert!((one[row][column] - IDENTITY6[row][column]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn the_exponential_of_a_rotation_is_a_rotation() {
        let angle = 30.0;
        let out = exponential(&[vec![0.0, -angle], vec![angle, 0.0]]);
        assert!((out[0][0] - libm::cos(angle)).abs() < 1e-13 && (out[1][0] - libm::sin(angle)).abs() < 1e-13);
    }

    #[test]
    fn eigenvectors_diagonalise_both_matrices() {
        let a = sample();
        let (mut stiffness, mut mass) = (IDENTITY6, IDENTITY6);
        add_congruent(&mut stiffness, &a, &[3.0, 1.0, 4.0, 1.0, 5.0, 9.0]);
        add_congruent(&mut mass, &transposed(&a), &[2.0, 7.0, 1.0, 8.0, 2.0, 8.0]);
        let (values, vectors) = generalised_eigen(&stiffness, &mass);
        let k = product(&transposed(&vectors), &product(&stiffness, &vectors));
        let m = product(&transposed(&vectors), &product(&mass, &vectors));
        for i in 0..6 {
            for j in 0..6 {
                let expected = if i == j { values[i] } else { 0.0 };
                assert!((k[i][j] - expected).abs() < 1e-12, "{k:?}");
                assert!((m[i][j] - IDENTITY6[i][j]).abs() < 1e-12, "{m:?}");
            }
        }
        assert!(values.windows(2).all(|pair| pair[0] <= pair[1]));
    }
}
