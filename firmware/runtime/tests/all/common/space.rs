//! Vectors and turns in space.

pub type Matrix = [[f64; 3]; 3];

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn times(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| dot(row, v))
}

pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

pub fn transpose(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Rz Ry Rx, factor by factor.
pub fn rotation(angles: [f64; 3]) -> Matrix {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(f64::sin_cos);
    let x = [[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]];
    let y = [[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]];
    let z = [[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]];
    product(&product(&z, &y), &x)
}

/// The inverse of a matrix, row by row, with pivots.
pub fn inverse(matrix: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    let mut left = *matrix;
    let mut right: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for k in 0..6 {
        let pivot = (k..6).max_by(|a, b| left[*a][k].abs().total_cmp(&left[*b][k].abs())).expect("a row");
        left.swap(k, pivot);
        right.swap(k, pivot);
        let by = 1.0 / left[k][k];
        left[k] = left[k].map(|x| x * by);
        right[k] = right[k].map(|x| x * by);
        for i in (0..6).filter(|i| *i != k) {
            let factor = left[i][k];
            left[i] = std::array::from_fn(|j| left[i][j] - factor * left[k][j]);
            right[i] = std::array::from_fn(|j| right[i][j] - factor * right[k][j]);
        }
    }
    right
}
