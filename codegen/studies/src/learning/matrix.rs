//! Complex 6×6 matrices.

use specgen_numerics::nyquist::{Complex, over, plus, square, times};

/// Number of squarings for the bound of the spectral radius: ‖M³²‖^(1/32).
const SQUARINGS: i32 = 5;

/// A complex 6×6 matrix.
pub(super) type Matrix6c = [[Complex; 6]; 6];

/// I − share · product.
pub(super) fn left(product: &Matrix6c, share: f64) -> Matrix6c {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| [f64::from(i == j) - share * product[i][j][0], -share * product[i][j][1]])
    })
}

pub(super) fn multiply(a: &Matrix6c, b: &Matrix6c) -> Matrix6c {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..6).fold([0.0; 2], |sum, k| plus(sum, times(a[i][k], b[k][j])))))
}

/// A close upper bound of the spectral radius: ‖M^n‖^(1/n).
pub(super) fn spectral_radius(matrix: &Matrix6c) -> f64 {
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
pub(super) fn norm(matrix: &Matrix6c) -> f64 {
    let sums = matrix.iter().map(|row| row.iter().map(|value| libm::sqrt(square(*value))).sum::<f64>());
    sums.fold(0.0, larger)
}

/// The larger of two; NaN if either is.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// The inverse by elimination with row pivots; not finite for a singular matrix.
pub(super) fn inverse(matrix: &Matrix6c) -> Matrix6c {
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
