//! 6×6 matrices in plain loops: the same bits on every computer.

pub(super) use specgen_numerics::{Matrix6 as Matrix, cross, dot, norm};

/// The inverse by Gauss-Jordan elimination with complete pivoting; none if a pivot vanishes.
pub(super) fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let mut a = *matrix;
    let mut b = [[0.0; 6]; 6];
    for (k, row) in b.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    // Row and column of each pivot.
    let mut pivots = [(0, 0); 6];
    let mut row_done = [false; 6];
    let mut column_done = [false; 6];
    for pivot in &mut pivots {
        let mut best = 0.0;
        for (i, row) in a.iter().enumerate().filter(|(i, _)| !row_done[*i]) {
            for (j, value) in row.iter().enumerate().filter(|(j, _)| !column_done[*j]) {
                if value.abs() > best {
                    (best, *pivot) = (value.abs(), (i, j));
                }
            }
        }
        if best == 0.0 {
            return None;
        }
        let (i, j) = *pivot;
        (row_done[i], column_done[j]) = (true, true);
        let scale = a[i][j];
        for k in 0..6 {
            a[i][k] /= scale;
            b[i][k] /= scale;
        }
        let (pivot_a, pivot_b) = (a[i], b[i]);
        for r in (0..6).filter(|r| *r != i) {
            let factor = a[r][j];
            for k in 0..6 {
                a[r][k] -= factor * pivot_a[k];
                b[r][k] -= factor * pivot_b[k];
            }
        }
    }
    // Row i of `b` is the unknown of column j.
    let mut inverse = [[0.0; 6]; 6];
    for (i, j) in pivots {
        inverse[j] = b[i];
    }
    Some(inverse)
}

/// The matrix with rounding errors set to zero: entries below 10⁻¹³ of the size of their row.
pub(super) fn without_dust(matrix: Matrix, size_of_row: [f64; 6]) -> Matrix {
    let mut clean = matrix;
    for (row, size) in clean.iter_mut().zip(size_of_row) {
        for value in row {
            *value = dusted(*value, size);
        }
    }
    clean
}

/// Zero for a value below 10⁻¹³ of `size`.
pub(super) fn dusted(value: f64, size: f64) -> f64 {
    if value.abs() < 1e-13 * size { 0.0 } else { value }
}

/// Gives one magnitude to numbers that agree within a share of `tolerance`, except for their sign: it restores the symmetry of a
/// platform, so that the controller holds one constant for all of them.
pub(super) fn alike(values: &mut [f64], tolerance: f64) {
    for k in 1..values.len() {
        let (before, rest) = values.split_at_mut(k);
        if let Some(value) = rest.first_mut() {
            let size = value.abs();
            let same = |other: &&f64| (other.abs() - size).abs() <= tolerance * size;
            if let Some(other) = before.iter().find(same) {
                *value = if *value < 0.0 { -other.abs() } else { other.abs() };
            }
        }
    }
}

/// The same for a matrix.
pub(super) fn with_alike(mut matrix: Matrix) -> Matrix {
    alike(matrix.as_flattened_mut(), 1e-13);
    matrix
}

/// The 3⁶ poses whose coordinates are at their bound, its negative, or zero.
pub(super) fn grid(bound: [f64; 6]) -> impl Iterator<Item = [f64; 6]> {
    (0..729_u32).map(move |index| {
        let mut rest = index;
        bound.map(|bound| {
            let sign = f64::from(rest % 3) - 1.0;
            rest /= 3;
            sign * bound
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_agrees_but_for_rounding_gets_one_magnitude() {
        let mut values = [0.5, -0.500_000_000_000_000_1, 0.0, 0.500_000_1, -0.0, 0.499_999_999_999_999_94];
        alike(&mut values, 1e-15);
        assert_eq!(values, [0.5, -0.5, 0.0, 0.500_000_1, 0.0, 0.5]);
    }

    #[test]
    fn the_inverse_times_the_matrix_is_one_also_where_plain_elimination_meets_a_zero() {
        let mut state = 7_u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let mut matrices: Vec<Matrix> = (0..50).map(|_| [[0.0; 6]; 6].map(|row| row.map(|_| unit()))).collect();
        // A permutation: every leading minor is zero.
        let mut cyclic = [[0.0; 6]; 6];
        for (k, row) in cyclic.iter_mut().enumerate() {
            row[(k + 1) % 6] = 2.0;
        }
        matrices.push(cyclic);
        for matrix in &matrices {
            let inverse = inverse(matrix).unwrap();
            let one = specgen_numerics::multiply6(&inverse, matrix);
            for (i, row) in one.iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    assert!((value - f64::from(u8::from(i == j))).abs() < 1e-11, "{i} {j}: {value}");
                }
            }
        }
        let mut singular = matrices[0];
        singular[3] = [0.0; 6];
        assert_eq!(inverse(&singular), None);
    }
}
