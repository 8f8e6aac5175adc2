//! Assumption on weights that the record leaves undetermined: neighbouring cells have similar weights.

use nalgebra::DMatrix;

use crate::everett::EverettTable;

/// Penalty on the squared difference of neighbouring weights, as a fraction of the mean diagonal of the Gram matrix.
///
/// It decides where the record has no information (a cell that no branch crosses), and has no visible effect elsewhere:
/// a cell that switches in one sample of a thousand outweighs it.
const SMOOTHNESS: f64 = 1e-6;
/// Share of the mean diagonal that keeps the matrix positive definite in floating point.
const RIDGE: f64 = 1e-12;

/// Adds the penalty to `gram` (both triangles).
///
/// Neighbours share an edge in the plane. The triangles on the diagonal include the reversible part and are much
/// heavier than the cells beside them: they are neighbours only of each other.
pub fn add(grid: usize, gram: &mut DMatrix<f64>) {
    let count = gram.nrows();
    let mean = (0..count).fold(0.0, |sum, k| sum + gram[(k, k)]) / count as f64;
    let strength = SMOOTHNESS * mean;
    for k in 0..count {
        gram[(k, k)] += RIDGE * mean;
    }
    for up in 1..=grid {
        for down in 0..up {
            let cell = EverettTable::index(up, down);
            if down + 1 == up {
                if up < grid {
                    tie(gram, cell, EverettTable::index(up + 1, down + 1), strength);
                }
                continue;
            }
            if up < grid {
                tie(gram, cell, EverettTable::index(up + 1, down), strength);
            }
            if down + 2 < up {
                tie(gram, cell, EverettTable::index(up, down + 1), strength);
            }
        }
    }
}

fn tie(gram: &mut DMatrix<f64>, a: usize, b: usize, strength: f64) {
    gram[(a, a)] += strength;
    gram[(b, b)] += strength;
    gram[(a, b)] -= strength;
    gram[(b, a)] -= strength;
}
