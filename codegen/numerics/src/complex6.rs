//! 6×6 matrices, complex and real.

use crate::Matrix6;
use crate::nyquist::{Complex, over, plus, square, times};

/// Number of squarings for the bound of the spectral radius: ‖M³²‖^(1/32).
const SQUARINGS: i32 = 5;

/// A complex 6×6 matrix.
pub type Matrix6c = [[Complex; 6]; 6];

/// I − share · product.
pub fn left(product: &Matrix6c, share: f64) -> Matrix6c {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| [f64::from(i == j) - share * product[i][j][0], -share * product[i][j][1]])
    })
}

/// matrix · vector.
pub fn mapped(matrix: &Matrix6, vector: &[f64; 6]) -> [f64; 6] {
    matrix.map(|row| row.iter().zip(vector).map(|(factor, value)| factor * value).sum())
}

/// a b.
pub fn multiply(a: &Matrix6c, b: &Matrix6c) -> Matrix6c {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..6).fold([0.0; 2], |sum, k| plus(sum, times(a[i][k], b[k][j])))))
}

/// A close upper bound of the spectral radius: ‖M^n‖^(1/n).
pub fn spectral_radius(matrix: &Matrix6c) -> f64 {
    let mut power = *matrix;
    let mut scale = 0.0;
    for _ in 0..SQUARINGS {
        let norm = norm(&power);
        if norm == 0.0 || !norm.is_finite() {
            return norm;
        }
        // Normalised to 1; the logarithm of the factor is kept separately.
        power = power.map(|row| row.map(|value| value.map(|part| part / norm)));
        power = multiply(&power, &power);
        scale = 2.0 * (scale + libm::log(norm));
    }
    libm::exp((scale + libm::log(norm(&power))) / libm::exp2(f64::from(SQUARINGS)))
}

/// Largest row sum of magnitudes.
pub fn norm(matrix: &Matrix6c) -> f64 {
    let sums = matrix.iter().map(|row| row.iter().map(|value| libm::sqrt(square(*value))).sum::<f64>());
    sums.fold(0.0, larger)
}

/// The larger of two; NaN if either is.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// The inverse by elimination with row pivots; not finite for a singular matrix.
pub fn inverse(matrix: &Matrix6c) -> Matrix6c {
    let mut a = *matrix;
    let mut b: Matrix6c = std::array::from_fn(|i| std::array::from_fn(|j| [f64::from(i == j), 0.0]));
    for k in 0..6 {
        let pivot = (k..6).max_by(|i, j| square(a[*i][k]).total_cmp(&square(a[*j][k]))).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        let leading = a[k][k];
        a[k] = a[k].map(|value| over(value, leading));
        b[k] = b[k].map(|value| over(value, leading));
        for i in (0..6).filter(|i| *i != k) {
            let factor = a[i][k].map(|part| -part);
            a[i] = std::array::from_fn(|j| plus(a[i][j], times(factor, a[k][j])));
            b[i] = std::array::from_fn(|j| plus(b[i][j], times(factor, b[k][j])));
        }
    }
    b
}

/// a + factor · b.
pub fn sum(a: &Matrix6c, b: &Matrix6c, factor: f64) -> Matrix6c {
    std::array::from_fn(|i| std::array::from_fn(|j| plus(a[i][j], b[i][j].map(|part| factor * part))))
}

/// Adds factor · column · row.
pub fn add_product(to: &mut Matrix6c, factor: Complex, column: &[Complex; 6], row: &[Complex; 6]) {
    for (to, value) in to.iter_mut().zip(column) {
        let value = times(factor, *value);
        for (to, other) in to.iter_mut().zip(row) {
            *to = plus(*to, times(value, *other));
        }
    }
}

/// The numbers of a matrix by row, Re before Im, each times the weight of its entry.
pub fn weighted(weights: &[[f64; 6]; 6], matrix: &Matrix6c) -> [f64; 72] {
    std::array::from_fn(|k| {
        let (i, j) = (k / 12, k / 2 % 6);
        weights[i][j] * matrix[i][j][k % 2]
    })
}

/// Scalar product, in eight sums, which the compiler turns into vector instructions here.
#[inline(never)]
pub fn dot(a: &[f64; 72], b: &[f64; 72]) -> f64 {
    let mut sums = [0.0; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_is_correct_and_the_bound_of_the_radius_close() {
        let mut state = 1_u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        let matrix: Matrix6c = std::array::from_fn(|_| std::array::from_fn(|_| [draw(), draw()]));
        let off = left(&multiply(&matrix, &inverse(&matrix)), 1.0);
        assert!(norm(&off) < 1e-13, "{off:?}");
        // Similar to a triangular matrix, so its eigenvalues are on the diagonal.
        let triangle: Matrix6c = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if j < i {
                    [0.0; 2]
                } else if i == j {
                    [0.1 * i as f64, 0.3]
                } else {
                    [draw(), 0.0]
                }
            })
        });
        let similar = multiply(&multiply(&matrix, &triangle), &inverse(&matrix));
        let radius = spectral_radius(&similar);
        let expected = libm::hypot(0.5, 0.3);
        assert!(radius >= expected * (1.0 - 1e-9) && radius < 1.15 * expected, "{radius} {expected}");
        // A NaN entry leaves no bound.
        for (row, column) in [(0, 0), (3, 1), (5, 5)] {
            let mut spoilt = similar;
            spoilt[row][column][1] = f64::NAN;
            assert!(spectral_radius(&spoilt).is_nan(), "{row} {column}");
        }
    }
}
