//! 6 × 6 matrices whose entries reach emitted text: plain loops in written order, so that every machine gets the same bytes.
//! (Library products pick their instructions by the CPU.)

/// Six rows of six.
pub type Matrix6 = [[f64; 6]; 6];

/// Zero matrix.
pub const ZERO: Matrix6 = [[0.0; 6]; 6];

/// `left · right`.
#[must_use]
pub fn product(left: &Matrix6, right: &Matrix6) -> Matrix6 {
    let mut result = ZERO;
    for (row, left) in result.iter_mut().zip(left) {
        for (column, value) in row.iter_mut().enumerate() {
            for (factor, right) in left.iter().zip(right) {
                *value += factor * right[column];
            }
        }
    }
    result
}

/// `matrix · vector`.
#[must_use]
pub fn apply(matrix: &Matrix6, vector: &[f64; 6]) -> [f64; 6] {
    matrix.map(|row| row.iter().zip(vector).fold(0.0, |sum, (a, b)| sum + a * b))
}

/// Rows become columns.
#[must_use]
pub fn transpose(matrix: &Matrix6) -> Matrix6 {
    let mut result = ZERO;
    for (row, values) in matrix.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            result[column][row] = *value;
        }
    }
    result
}

/// Every entry times `factor`.
#[must_use]
pub fn scaled(matrix: &Matrix6, factor: f64) -> Matrix6 {
    matrix.map(|row| row.map(|value| factor * value))
}

/// Inverse by elimination with the largest pivot of each column, rows scaled to their largest entry first; none for a matrix
/// that is singular to working precision.
#[must_use]
pub fn inverse(matrix: &Matrix6) -> Option<Matrix6> {
    let mut left = *matrix;
    let mut right = ZERO;
    for (index, (row, unit)) in left.iter_mut().zip(&mut right).enumerate() {
        let largest = row.iter().fold(0.0_f64, |most, value| if value.abs() > most { value.abs() } else { most });
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        *row = row.map(|value| value / largest);
        unit[index] = 1.0 / largest;
    }
    for column in 0..6 {
        let pivot = (column..6).fold(column, |best, row| {
            if left[row][column].abs() > left[best][column].abs() { row } else { best }
        });
        left.swap(column, pivot);
        right.swap(column, pivot);
        let divisor = left[column][column];
        if divisor.abs() < 1e-14 {
            return None;
        }
        left[column] = left[column].map(|value| value / divisor);
        right[column] = right[column].map(|value| value / divisor);
        let (pivot_left, pivot_right) = (left[column], right[column]);
        for row in (0..6).filter(|row| *row != column) {
            let factor = left[row][column];
            for k in 0..6 {
                left[row][k] -= factor * pivot_left[k];
                right[row][k] -= factor * pivot_right[k];
            }
        }
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_matrix_and_a_singular_one_has_none() {
        let mut matrix = ZERO;
        let mut state = 1_u32;
        for value in matrix.as_flattened_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *value = f64::from(state) / f64::from(u32::MAX) - 0.5;
        }
        // Units as different as those of forces and torques.
        matrix[3] = matrix[3].map(|value| value * 1e-4);
        let unit = product(&matrix, &inverse(&matrix).unwrap());
        for (row, values) in unit.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                assert!((value - f64::from(u8::from(row == column))).abs() < 1e-12, "{unit:?}");
            }
        }
        assert_eq!(apply(&transpose(&matrix), &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), matrix[0]);
        matrix[5] = matrix[2].map(|value| 2.0 * value);
        assert_eq!(inverse(&matrix), None);
        assert_eq!(inverse(&ZERO), None);
    }
}
