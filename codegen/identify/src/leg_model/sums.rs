//! Sums of products over samples. Every sum takes the samples in their order, whatever registers hold meanwhile: its bits depend
//! neither on the processor nor on the blocks.

/// Samples that are summed at once: their rows stay in the nearest cache.
const BLOCK: usize = 64;

/// Values of samples, a row of `width` columns for each.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub(super) values: &'a [f64],
    pub(super) width: usize,
}

impl<'a> Rows<'a> {
    /// Rows of the samples in `span`.
    pub(super) fn of(self, span: &core::ops::Range<usize>) -> Self {
        Self { values: &self.values[span.start * self.width..span.end * self.width], ..self }
    }

    fn blocks(self, samples: usize) -> impl Iterator<Item = Self> {
        self.values.chunks(samples * self.width).map(move |values| Self { values, ..self })
    }

    fn rows(self) -> impl Iterator<Item = &'a [f64]> {
        self.values.chunks_exact(self.width)
    }

    /// The values less the mean of their column.
    pub(super) fn centred(self) -> Vec<f64> {
        let mut means = vec![0.0; self.width];
        for row in self.rows() {
            means.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
        let count = (self.values.len() / self.width) as f64;
        means.iter_mut().for_each(|sum| *sum /= count);
        let mut values = self.values.to_vec();
        for row in values.chunks_exact_mut(self.width) {
            row.iter_mut().zip(&means).for_each(|(value, mean)| *value -= mean);
        }
        values
    }

    /// Adds to the sum of each sample the values of `columns`, times their factors, in their order.
    pub(super) fn add_columns(self, sums: &mut [f64], columns: &[(usize, f64)]) {
        const AT_ONCE: usize = 8;
        for (sums, block) in sums.chunks_mut(AT_ONCE).zip(self.blocks(AT_ONCE)) {
            let Ok(mut own) = <[f64; AT_ONCE]>::try_from(&*sums) else {
                for (sum, row) in sums.iter_mut().zip(block.rows()) {
                    columns.iter().for_each(|(column, factor)| *sum += factor * row[*column]);
                }
                continue;
            };
            for (column, factor) in columns {
                for (k, sum) in own.iter_mut().enumerate() {
                    *sum += factor * block.values[k * self.width + column];
                }
            }
            sums.copy_from_slice(&own);
        }
    }
}

/// Adds the product of each column of `weights` and each of `rows` to its sum; the sums of one column of `weights` are a row of
/// `sums`. `triangle` is for columns with one another: products left of the diagonal may be left out.
pub(super) fn add_products(sums: &mut [f64], weights: Rows<'_>, rows: Rows<'_>, triangle: bool) {
    for (weights, rows) in weights.blocks(BLOCK).zip(rows.blocks(BLOCK)) {
        let mut first = 0;
        while first < weights.width {
            let sums = &mut sums[first * rows.width..];
            let (weights, from) = ((weights, first), if triangle { first } else { 0 });
            first += match weights.0.width - first {
                5 => add_rows::<5>(sums, weights, rows, from),
                4.. => add_rows::<4>(sums, weights, rows, from),
                // The sums of one column alone would wait for each other.
                _ => {
                    let from = add_blocks::<1, 16>(sums, weights, rows, from);
                    add_rows::<1>(sums, weights, rows, from)
                }
            };
        }
    }
}

/// The products of `A` columns of `weights` and the columns of `rows` from `from` on; returns `A`.
fn add_rows<const A: usize>(sums: &mut [f64], weights: (Rows<'_>, usize), rows: Rows<'_>, from: usize) -> usize {
    let from = add_blocks::<A, 4>(sums, weights, rows, from);
    add_blocks::<A, 1>(sums, weights, rows, from);
    A
}

/// The same, `F` columns at once, as long as there are so many; returns the first column that is left.
#[allow(clippy::needless_range_loop)] // Sums that an iterator goes over stay in memory, not in registers.
fn add_blocks<const A: usize, const F: usize>(
    sums: &mut [f64],
    (weights, first): (Rows<'_>, usize),
    rows: Rows<'_>,
    mut from: usize,
) -> usize {
    while from + F <= rows.width {
        let mut own = [[0.0; F]; A];
        for a in 0..A {
            for k in 0..F {
                own[a][k] = sums[a * rows.width + from + k];
            }
        }
        let samples = rows.values.len() / rows.width;
        for sample in 0..samples {
            let weights = &weights.values[sample * weights.width + first..][..A];
            let row = &rows.values[sample * rows.width + from..][..F];
            for a in 0..A {
                for k in 0..F {
                    own[a][k] += weights[a] * row[k];
                }
            }
        }
        for a in 0..A {
            for k in 0..F {
                sums[a * rows.width + from + k] = own[a][k];
            }
        }
        from += F;
    }
    from
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that round in every sum, of samples in several blocks and a rest.
    fn values(count: usize) -> Vec<f64> {
        (0..count).map(|k| libm::sin(1.0 + 0.7 * k as f64) / (1.0 + (k % 7) as f64)).collect()
    }

    #[test]
    fn products_are_those_of_one_sample_after_the_other() {
        const SAMPLES: usize = 2 * BLOCK + 13;
        for (count, width) in [(1, 1), (1, 37), (4, 2), (5, 41), (6, 18), (23, 23)] {
            let (own, columns) = (values(SAMPLES * count), values(SAMPLES * width));
            let (own, columns) = (Rows { values: &own, width: count }, Rows { values: &columns, width });
            let mut plain = values(count * width);
            let mut sums = plain.clone();
            for (own, row) in own.rows().zip(columns.rows()) {
                for (sum, (own, value)) in
                    plain.iter_mut().zip(own.iter().flat_map(|own| row.iter().map(move |value| (own, value))))
                {
                    *sum += own * value;
                }
            }
            add_products(&mut sums, own, columns, false);
            assert_eq!(sums, plain, "{count} and {width} columns");
        }
    }

    #[test]
    fn a_triangle_has_the_diagonal_and_what_is_right_of_it() {
        let columns = values(100 * 11);
        let rows = Rows { values: &columns, width: 11 };
        let (mut all, mut right) = (vec![0.0; 121], vec![0.0; 121]);
        add_products(&mut all, rows, rows, false);
        add_products(&mut right, rows, rows, true);
        for (k, (all, right)) in all.iter().zip(&right).enumerate() {
            assert!(k % 11 < k / 11 || all == right, "{k}: {all} {right}");
        }
    }

    #[test]
    fn columns_are_added_in_their_order() {
        let columns = values(21 * 6);
        let rows = Rows { values: &columns, width: 6 };
        let used = [(4, 0.3), (0, -1.7), (5, 1e-9)];
        let mut sums = values(21);
        let plain: Vec<f64> = sums
            .iter()
            .zip(rows.rows())
            .map(|(sum, row)| used.iter().fold(*sum, |sum, (column, factor)| sum + factor * row[*column]))
            .collect();
        rows.add_columns(&mut sums, &used);
        assert_eq!(sums, plain);
    }

    #[test]
    fn centred_columns_have_no_mean() {
        let centred = Rows { values: &[1.0, 10.0, 3.0, 30.0], width: 2 }.centred();
        assert_eq!(centred, [-1.0, -10.0, 1.0, 10.0]);
    }
}
