//! Least squares on a handful of columns, by normal equations of columns scaled to unit length.
//!
//! Written out in fixed order, so that results do not depend on the CPU instructions of a matrix library.

use nalgebra::{Cholesky, DMatrix, DVector};

/// A linear fit y ≈ Σ coefficient·column.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Coefficients in the order of the columns.
    pub coefficients: Vec<f64>,
    /// Covariance of the coefficients for residuals of unit variance.
    pub covariance: DMatrix<f64>,
    /// y less the fit, sample by sample.
    pub residual: Vec<f64>,
}

/// Fits `y` by `columns`, each as long as `y`; none if they are (nearly) dependent or empty.
#[must_use]
pub fn fit(columns: &[&[f64]], y: &[f64]) -> Option<Fit> {
    let n = columns.len();
    let mut scale = Vec::with_capacity(n);
    for column in columns {
        let length = dot(column, column).sqrt();
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        scale.push(1.0 / length);
    }
    let gram = DMatrix::from_fn(n, n, |r, c| scale[r] * scale[c] * dot(columns[r], columns[c]));
    let rhs = DVector::from_fn(n, |r, _| scale[r] * dot(columns[r], y));
    let factor = Cholesky::new(gram)?;
    // A pivot below the rounding of the sums shows that the column depends on the ones before it.
    if (0..n).any(|k| factor.l_dirty()[(k, k)] < 1e-6) {
        return None;
    }
    let solved = factor.solve(&rhs);
    let coefficients: Vec<f64> = (0..n).map(|k| solved[k] * scale[k]).collect();
    let inverse = factor.inverse();
    let covariance = DMatrix::from_fn(n, n, |r, c| inverse[(r, c)] * scale[r] * scale[c]);
    let residual = (0..y.len())
        .map(|k| columns.iter().zip(&coefficients).fold(y[k], |rest, (column, c)| rest - c * column[k]))
        .collect();
    Some(Fit { coefficients, covariance, residual })
}

/// Sum of the products, in order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, z)| sum + x * z)
}

/// Mean of the squares; 0 for none.
#[must_use]
pub fn mean_square(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().fold(0.0, |sum, v| sum + v * v) / values.len() as f64 }
}

/// Number of independent samples of `residual`, from its correlation at lag one (Bartlett): n (1 − r)/(1 + r).
#[must_use]
pub fn independent_samples(residual: &[f64]) -> f64 {
    let energy = mean_square(residual) * residual.len() as f64;
    let lagged = residual.windows(2).fold(0.0, |sum, w| sum + w[0] * w[1]);
    let r = if energy > 0.0 { (lagged / energy).clamp(0.0, 0.999) } else { 0.0 };
    residual.len() as f64 * (1.0 - r) / (1.0 + r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_and_dependent_columns_are_refused() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let one = vec![1.0; 50];
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.5 * x).collect();
        let found = fit(&[&one, &x], &y).unwrap();
        assert!((found.coefficients[0] - 3.0).abs() < 1e-10 && (found.coefficients[1] + 0.5).abs() < 1e-12);
        let twice: Vec<f64> = x.iter().map(|x| 2.0 * x).collect();
        assert!(fit(&[&x, &twice], &y).is_none());
        assert!(fit(&[&[0.0; 50]], &y).is_none());
    }
}
