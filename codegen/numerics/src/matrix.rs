//! Dense matrices: of any size, row by row, and 6 × 6 as arrays.

use core::ops::{Index, IndexMut};

/// 6 × 6, rows of columns.
pub type Matrix6 = [[f64; 6]; 6];

/// The product A B.
pub fn multiply6(a: &Matrix6, b: &Matrix6) -> Matrix6 {
    let mut product = [[0.0; 6]; 6];
    for (row, out) in a.iter().zip(&mut product) {
        for (factor, b_row) in row.iter().zip(b) {
            for (sum, x) in out.iter_mut().zip(b_row) {
                *sum += factor * x;
            }
        }
    }
    product
}

/// The transposed matrix Aᵀ.
pub fn transpose6(a: &Matrix6) -> Matrix6 {
    core::array::from_fn(|i| core::array::from_fn(|j| a[j][i]))
}

/// A square matrix of any size, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    size: usize,
    entries: Vec<f64>,
}

impl Matrix {
    /// A matrix of `size` rows whose entries are zero.
    pub fn zeros(size: usize) -> Self {
        Self { size, entries: vec![0.0; size * size] }
    }

    /// The identity of `size` rows.
    pub fn identity(size: usize) -> Self {
        let mut matrix = Self::zeros(size);
        for i in 0..size {
            matrix[(i, i)] = 1.0;
        }
        matrix
    }

    /// Number of rows, and of columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The entries of one row; rows count from 0.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.size..(row + 1) * self.size]
    }

    /// Replaces the entries of one row.
    pub fn set_row(&mut self, row: usize, values: &[f64]) {
        self.entries[row * self.size..(row + 1) * self.size].copy_from_slice(values);
    }

    /// Every entry times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { size: self.size, entries: self.entries.iter().map(|x| x * factor).collect() }
    }

    /// Aᵀ.
    pub fn transposed(&self) -> Self {
        let mut transposed = Self::zeros(self.size);
        for row in 0..self.size {
            for column in 0..self.size {
                transposed[(column, row)] = self[(row, column)];
            }
        }
        transposed
    }

    /// A B. Products with a zero entry are left out, so that blocks that do not couple stay exactly separate.
    pub fn times(&self, other: &Self) -> Self {
        let mut product = Self::zeros(self.size);
        for i in 0..self.size {
            for k in 0..self.size {
                let factor = self[(i, k)];
                if factor == 0.0 {
                    continue;
                }
                let out = &mut product.entries[i * self.size..(i + 1) * self.size];
                for (sum, x) in out.iter_mut().zip(other.row(k)) {
                    *sum += factor * x;
                }
            }
        }
        product
    }

    /// self += factor · other.
    pub fn add_scaled(&mut self, factor: f64, other: &Self) {
        for (a, b) in self.entries.iter_mut().zip(&other.entries) {
            *a += factor * b;
        }
    }

    /// Largest sum of magnitudes in a row.
    pub fn row_norm(&self) -> f64 {
        let mut largest = 0.0;
        for i in 0..self.size {
            let mut sum = 0.0;
            for x in self.row(i) {
                sum += x.abs();
            }
            if sum > largest || sum.is_nan() {
                largest = sum;
            }
        }
        largest
    }

    /// Index sets that do not couple, each in rising order: the matrix is block diagonal over them.
    pub fn blocks(&self) -> Vec<Vec<usize>> {
        let mut block_of: Vec<Option<usize>> = vec![None; self.size];
        let mut blocks: Vec<Vec<usize>> = Vec::new();
        for first in 0..self.size {
            if block_of[first].is_some() {
                continue;
            }
            let this = blocks.len();
            let mut members = Vec::new();
            let mut open = vec![first];
            block_of[first] = Some(this);
            while let Some(i) = open.pop() {
                members.push(i);
                for j in 0..self.size {
                    let coupled = self[(i, j)] != 0.0 || self[(j, i)] != 0.0;
                    if coupled && block_of[j].is_none() {
                        block_of[j] = Some(this);
                        open.push(j);
                    }
                }
            }
            members.sort_unstable();
            blocks.push(members);
        }
        blocks
    }

    /// Rows and columns of `members`.
    pub fn restricted(&self, members: &[usize]) -> Self {
        let mut part = Self::zeros(members.len());
        for (i, &row) in members.iter().enumerate() {
            for (j, &column) in members.iter().enumerate() {
                part[(i, j)] = self[(row, column)];
            }
        }
        part
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        &self.entries[row * self.size + column]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        &mut self.entries[row * self.size + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_through_one_sided_coupling() {
        let mut matrix = Matrix::identity(5);
        matrix[(0, 3)] = 1.0;
        matrix[(4, 3)] = 2.0;
        assert_eq!(matrix.blocks(), [vec![0, 3, 4], vec![1], vec![2]]);
        assert_eq!(matrix.restricted(&[0, 3, 4]).row(2), [0.0, 2.0, 1.0]);
    }
}
