//! Cholesky factors of large symmetric matrices, by blocks. The bits are the same on every machine, because every sum
//! has a written order. It is fast, because most of the work is a product of small blocks that stay in registers.
//!
//! Row i of the factor depends only on the rows above it. So a matrix whose first rows are unchanged is factored from
//! its first new row on.

/// Width of a block, columns.
const BLOCK: usize = 64;
/// Rows and columns that are multiplied in registers.
const TILE: usize = 4;
/// Right-hand sides that are solved together.
const LANES: usize = 8;
/// Number of multiplications above which several threads are faster than one.
const WORTH_A_THREAD: usize = 2_000_000;
/// Most threads.
const THREADS: usize = 8;

/// L of A = L Lᵀ.
#[derive(Debug, Clone, Default)]
pub struct Factor {
    /// The rows in sequence, each `stride` long; entries above the diagonal have no meaning.
    rows: Vec<f64>,
    stride: usize,
    size: usize,
    threads: usize,
}

impl Factor {
    /// An empty factor with room for `most` rows.
    pub fn new(most: usize) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, |count| count.get().min(THREADS));
        Self { rows: vec![0.0; most * most], stride: most, size: 0, threads }
    }

    /// The factor of a matrix given by its lower triangle; `None` if it is not positive definite.
    pub fn of(size: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut factor = Self::new(size);
        factor.set(0, size, entry).then_some(factor)
    }

    /// Makes this the factor of another matrix of `size` rows, at most the room. Its first `kept` rows equal those of
    /// the previous matrix; `entry` (row, column ≤ row) gives the others. `false`, with an empty factor, if the matrix
    /// is not positive definite.
    #[must_use]
    pub fn set(&mut self, kept: usize, size: usize, entry: impl Fn(usize, usize) -> f64) -> bool {
        let (size, stride) = (size.min(self.stride), self.stride);
        let kept = kept.min(self.size).min(size);
        for row in kept..size {
            for (column, value) in self.rows[row * stride..=row * stride + row].iter_mut().enumerate() {
                *value = entry(row, column);
            }
        }
        let mut panel = Vec::new();
        self.size =
            if (0..size).step_by(BLOCK).all(|first| self.block(first, kept, size, &mut panel)) { size } else { 0 };
        self.size == size
    }

    /// One block of columns from `first` on: its part of the factor, and its contribution to the columns after it.
    fn block(&mut self, first: usize, kept: usize, size: usize, panel: &mut Vec<f64>) -> bool {
        let stride = self.stride;
        let end = if size - first < BLOCK { size } else { first + BLOCK };
        if !self.on_diagonal(first, kept, end) {
            return false;
        }
        let width = end - first;
        // The triangle on the diagonal by columns, and the rows below it in tiles, by columns too.
        let mut triangle = [0.0; BLOCK * BLOCK];
        for row in 0..width {
            for column in 0..=row {
                triangle[column * BLOCK + row] = self.rows[(first + row) * stride + first + column];
            }
        }
        panel.clear();
        panel.resize((size - end).div_ceil(TILE) * TILE * width, 0.0);
        let from = kept.saturating_sub(end) / TILE;
        for (tile, packed) in panel.chunks_exact_mut(TILE * width).enumerate() {
            for lane in 0..TILE.min(size - end - tile * TILE) {
                let at = (end + tile * TILE + lane) * stride + first;
                for (k, value) in self.rows[at..at + width].iter().enumerate() {
                    packed[k * TILE + lane] = *value;
                }
            }
            if tile >= from {
                let rows = end + tile * TILE..size;
                let before = packed.to_vec();
                substitute(packed, &triangle, width);
                for (lane, row) in rows.take(TILE).enumerate() {
                    for k in 0..width {
                        if row < kept {
                            packed[k * TILE + lane] = before[k * TILE + lane];
                        } else {
                            self.rows[row * stride + first + k] = packed[k * TILE + lane];
                        }
                    }
                }
            }
        }
        let tiles: Vec<&[f64]> = panel.chunks_exact(TILE * width).collect();
        let take = |below: usize, rows: &mut [f64]| {
            for (across, right) in tiles[..=below].iter().enumerate() {
                let product = product(tiles[below], right);
                let column = end + across * TILE;
                for ((lane, sums), own) in product.iter().enumerate().zip(rows.chunks_mut(stride)) {
                    let row = end + below * TILE + lane;
                    if row >= kept && row < size {
                        let count = TILE.min(row + 1 - column);
                        own[column..column + count].iter_mut().zip(sums).for_each(|(value, sum)| *value -= sum);
                    }
                }
            }
        };
        let below = self.rows[end * stride..size * stride].chunks_mut(TILE * stride).enumerate().skip(from);
        let work = (size - end) * (size - kept.max(end)) * width;
        let threads = if work < WORTH_A_THREAD { 1 } else { self.threads };
        if threads < 2 {
            below.for_each(|(tile, rows)| take(tile, rows));
        } else {
            // Each row's sum is the same as with one thread: the number of threads changes no bit.
            let mut shares: Vec<Vec<(usize, &mut [f64])>> = (0..threads).map(|_| Vec::new()).collect();
            below.for_each(|(tile, rows)| shares[tile % threads].push((tile, rows)));
            std::thread::scope(|scope| {
                for share in shares {
                    scope.spawn(|| share.into_iter().for_each(|(tile, rows)| take(tile, rows)));
                }
            });
        }
        true
    }

    /// The rows `first..end` of the columns `first..end`.
    fn on_diagonal(&mut self, first: usize, kept: usize, end: usize) -> bool {
        let stride = self.stride;
        for row in kept.max(first)..end {
            for column in first..=row {
                let (own, other) = (row * stride, column * stride);
                let value = (first..column)
                    .fold(self.rows[own + column], |value, k| value - self.rows[own + k] * self.rows[other + k]);
                self.rows[own + column] = if column < row {
                    value / self.rows[other + column]
                } else if value > 0.0 {
                    value.sqrt()
                } else {
                    return false;
                };
            }
        }
        true
    }

    /// Solves A x = b in place, for `values` as long as the matrix.
    pub fn solve(&self, values: &mut [f64]) {
        let row = |k: usize| &self.rows[k * self.stride..=k * self.stride + k];
        for k in 0..self.size {
            let (before, rest) = values.split_at_mut(k);
            let sum = row(k).iter().zip(before).fold(rest[0], |sum, (l, x)| sum - l * *x);
            rest[0] = sum / row(k)[k];
        }
        for k in (0..self.size).rev() {
            let (before, rest) = values.split_at_mut(k);
            rest[0] /= row(k)[k];
            let x = rest[0];
            before.iter_mut().zip(row(k)).for_each(|(value, l)| *value -= l * x);
        }
    }
}

impl Factor {
    /// [`Factor::solve`] for several right-hand sides together: the same bits, faster.
    pub fn solve_all(&self, right_hand_sides: &mut [Vec<f64>]) {
        for group in right_hand_sides.chunks_mut(LANES) {
            let mut values = vec![[0.0; LANES]; self.size];
            for (lane, one) in group.iter().enumerate() {
                values.iter_mut().zip(one).for_each(|(value, b)| value[lane] = *b);
            }
            for k in 0..self.size {
                let row = &self.rows[k * self.stride..=k * self.stride + k];
                let (before, rest) = values.split_at_mut(k);
                for (l, x) in row.iter().zip(&*before) {
                    rest[0].iter_mut().zip(x).for_each(|(sum, x)| *sum -= l * x);
                }
                rest[0].iter_mut().for_each(|sum| *sum /= row[k]);
            }
            for k in (0..self.size).rev() {
                let row = &self.rows[k * self.stride..=k * self.stride + k];
                let (before, rest) = values.split_at_mut(k);
                rest[0].iter_mut().for_each(|x| *x /= row[k]);
                for (value, l) in before.iter_mut().zip(row) {
                    value.iter_mut().zip(&rest[0]).for_each(|(value, x)| *value -= l * x);
                }
            }
            for (lane, one) in group.iter_mut().enumerate() {
                one.iter_mut().zip(&values).for_each(|(b, value)| *b = value[lane]);
            }
        }
    }
}

/// X Tᵀ = `packed` for a tile of rows of X, in place; T by columns.
fn substitute(packed: &mut [f64], triangle: &[f64], width: usize) {
    for column in 0..width {
        let (done, rest) = packed.split_at_mut(TILE * (column + 1));
        let own = &triangle[column * BLOCK..column * BLOCK + width];
        let mut solved = [0.0; TILE];
        for (value, x) in done[TILE * column..].iter_mut().zip(&mut solved) {
            *value /= own[column];
            *x = *value;
        }
        for (values, l) in rest.chunks_exact_mut(TILE).zip(&own[column + 1..]) {
            values.iter_mut().zip(&solved).for_each(|(value, x)| *value -= l * x);
        }
    }
}

/// Product of two tiles of rows: sums over the columns, in their order.
fn product(left: &[f64], right: &[f64]) -> [[f64; TILE]; TILE] {
    let mut sums = [[0.0; TILE]; TILE];
    for (x, y) in left.chunks_exact(TILE).zip(right.chunks_exact(TILE)) {
        for (row, x) in sums.iter_mut().zip(x) {
            row.iter_mut().zip(y).for_each(|(sum, y)| *sum += x * y);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix whose entries are known in closed form.
    fn entry(row: usize, column: usize) -> f64 {
        let far = row.abs_diff(column) as f64;
        1.0 / (1.0 + 0.3 * far) + if row == column { 0.5 + 0.01 * (row % 7) as f64 } else { 0.0 }
    }

    #[test]
    fn the_solution_solves_and_kept_rows_change_no_bit() {
        for n in [1, 3, 63, 64, 65, 131, 200] {
            let factor = Factor::of(n, entry).unwrap();
            let wanted: Vec<f64> = (0..n).map(|k| (k % 5) as f64 - 1.5).collect();
            let mut values: Vec<f64> =
                (0..n).map(|r| (0..n).fold(0.0, |sum, c| sum + entry(r.max(c), r.min(c)) * wanted[c])).collect();
            factor.solve(&mut values);
            for (x, w) in values.iter().zip(&wanted) {
                assert!((x - w).abs() < 1e-12, "{n}: {x} against {w}");
            }
            for kept in [0, 1, n / 3, n / 2, n - 1, n] {
                let mut other = Factor::new(n + 10);
                assert!(other.set(0, n + 5, |r, c| entry(r, c) + if r == c && r >= kept { 1.0 } else { 0.0 }));
                assert!(other.set(kept, n, entry));
                for row in 0..n {
                    let bits = |f: &Factor| -> Vec<u64> {
                        f.rows[row * f.stride..=row * f.stride + row].iter().map(|x| x.to_bits()).collect()
                    };
                    assert_eq!(bits(&factor), bits(&other), "{n}, {kept} kept, row {row}");
                }
            }
        }
    }

    #[test]
    fn threads_and_right_hand_sides_beside_each_other_change_no_bit() {
        let n = 700;
        let factored = |threads: usize| {
            let mut factor = Factor { threads, ..Factor::new(n) };
            assert!(factor.set(0, n, entry));
            factor
        };
        let factor = factored(1);
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for threads in [2, 3, THREADS] {
            assert_eq!(bits(&factored(threads).rows), bits(&factor.rows), "{threads} threads");
        }
        let mut all: Vec<Vec<f64>> =
            (0..LANES + 3).map(|k| (0..n).map(|r| ((r * 7 + k) % 11) as f64).collect()).collect();
        let mut each = all.clone();
        each.iter_mut().for_each(|one| factor.solve(one));
        factor.solve_all(&mut all);
        for (one, other) in each.iter().zip(&all) {
            assert_eq!(bits(one), bits(other));
        }
        assert_ne!(bits(&all[0]), bits(&all[1]));
    }

    #[test]
    fn an_indefinite_matrix_is_refused_wherever_it_turns() {
        for at in [0, 5, 64, 90] {
            let broken = |r: usize, c: usize| if r == at && c == at { -1.0 } else { entry(r, c) };
            assert!(Factor::of(100, broken).is_none(), "{at}");
        }
        assert!(Factor::of(3, |_, _| f64::NAN).is_none());
    }
}
