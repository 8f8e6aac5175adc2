//! (z − A)⁻¹ B of a real matrix at many points z: the frequency response of a sampled system.

use crate::eigenvalues::reduce;
use crate::matrix::Matrix;
use crate::nyquist::{Complex, over, square, times};

/// A system x⁺ = A x + B u with six inputs, reduced once to Hessenberg form, so that a point costs n² operations.
#[derive(Debug, Clone)]
pub struct Resolvent {
    hessenberg: Matrix,
    /// B in its coordinates.
    input: Vec<[f64; 6]>,
    /// Exchanged rows and factors of each elimination, for the inverse transformation.
    steps: Vec<(usize, Vec<f64>)>,
    rows: Vec<Vec<Complex>>,
    right: Vec<[Complex; 6]>,
}

impl Resolvent {
    /// `input` has a row for each of the states.
    pub fn new(transition: &Matrix, input: &[[f64; 6]]) -> Self {
        let mut hessenberg = transition.clone();
        let steps = reduce(&mut hessenberg);
        let mut input = input.to_vec();
        for (at, (pivot, factors)) in steps.iter().enumerate() {
            let row = at + 1;
            input.swap(row, *pivot);
            let leading = input[row];
            for (below, factor) in input.iter_mut().skip(row + 1).zip(factors) {
                for (value, leading) in below.iter_mut().zip(leading) {
                    *value -= factor * leading;
                }
            }
        }
        let size = input.len();
        Self { hessenberg, input, steps, rows: vec![vec![[0.0; 2]; size]; size], right: vec![[[0.0; 2]; 6]; size] }
    }

    /// (z − A)⁻¹ B, a row per state, for z that is not an eigenvalue of A.
    pub fn at(&mut self, z: Complex) -> &[[Complex; 6]] {
        let size = self.input.len();
        for (index, row) in self.rows.iter_mut().enumerate() {
            for (column, entry) in row.iter_mut().enumerate().skip(index.saturating_sub(1)) {
                *entry = [-self.hessenberg[(index, column)], 0.0];
            }
            row[index][0] += z[0];
            row[index][1] += z[1];
        }
        for (right, input) in self.right.iter_mut().zip(&self.input) {
            *right = input.map(|value| [value, 0.0]);
        }
        // Elimination of the one entry below each diagonal, the larger of the two rows first.
        for k in 0..size.saturating_sub(1) {
            if square(self.rows[k + 1][k]) > square(self.rows[k][k]) {
                self.rows.swap(k, k + 1);
                self.right.swap(k, k + 1);
            }
            let factor = over(self.rows[k + 1][k], self.rows[k][k]);
            let (above, below) = self.rows.split_at_mut(k + 1);
            subtract(&mut below[0][k..], factor, &above[k][k..]);
            let (above, below) = self.right.split_at_mut(k + 1);
            subtract(&mut below[0], factor, &above[k]);
        }
        for k in (0..size).rev() {
            let (above, below) = self.right.split_at_mut(k + 1);
            for (entry, known) in self.rows[k][k + 1..].iter().zip(below.iter()) {
                subtract(&mut above[k], *entry, known);
            }
            for value in &mut above[k] {
                *value = over(*value, self.rows[k][k]);
            }
        }
        // Back to the original states: x = P₁L₁⁻¹ P₂L₂⁻¹ … of the reduced ones.
        for (at, (pivot, factors)) in self.steps.iter().enumerate().rev() {
            let row = at + 1;
            let leading = self.right[row];
            for (below, factor) in self.right.iter_mut().skip(row + 1).zip(factors) {
                subtract(below, [-factor, 0.0], &leading);
            }
            self.right.swap(row, *pivot);
        }
        &self.right
    }
}

/// `from` − `factor` · `what`, entry by entry.
fn subtract(from: &mut [Complex], factor: Complex, what: &[Complex]) {
    if factor == [0.0; 2] {
        return;
    }
    for (a, b) in from.iter_mut().zip(what) {
        let product = times(factor, *b);
        a[0] -= product[0];
        a[1] -= product[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nyquist::plus;

    /// (z − A) X = B, by multiplication.
    #[test]
    fn what_comes_back_solves_the_equations() {
        let size = 17;
        let mut a = Matrix::zeros(size);
        let mut state = 12_345_u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        for row in 0..size {
            // Half of it zero, as in a controller.
            let values: Vec<f64> = (0..size).map(|_| if draw() > 0.0 { draw() } else { 0.0 }).collect();
            a.set_row(row, &values);
        }
        let input: Vec<[f64; 6]> = (0..size).map(|_| core::array::from_fn(|_| draw())).collect();
        let mut resolvent = Resolvent::new(&a, &input);
        for angle in [0.01, 0.5, 3.0] {
            let z = [libm::cos(angle), libm::sin(angle)];
            let x = resolvent.at(z).to_vec();
            for row in 0..size {
                for column in 0..6 {
                    let mut sum = times(z, x[row][column]);
                    for k in 0..size {
                        sum = plus(sum, times([-a[(row, k)], 0.0], x[k][column]));
                    }
                    let off = plus(sum, [-input[row][column], 0.0]);
                    assert!(square(off) < 1e-24, "{angle} {row} {column}: {off:?}");
                }
            }
        }
    }
}
