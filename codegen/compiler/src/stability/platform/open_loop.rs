//! The open loop, cut at the requested leg displacements.

use core::f64::consts::TAU;

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::sampled::Plant;
use specgen_numerics::nyquist::Complex;
use specgen_runtime::ControlMode;

impl ClosedLoop {
    /// The open loop of each axis x to θz at `frequencies` (Hz, below half the tick rate), with the other axes open as well: gain
    /// (a ratio) and phase (degrees, unwrapped from that of the lowest frequency). With λ = 1, free of contact.
    #[must_use]
    pub fn open_loop(&self, law: ControlMode, tuning: &Tuning, frequencies: &[f64]) -> [Vec<[f64; 2]>; 6] {
        let at = |gain_ratio| self.transition(law, tuning, &Conditions { gain_ratio, ..Conditions::NOMINAL });
        // λ multiplies only the effect of the request on the plant, so the difference is the loop's return path.
        let (open, closed) = (at(0.0), at(1.0));
        let size = open.size();
        let plant = Plant::new(&self.basis, &self.damping, 1.0, &[[0.0; 6]; 6], self.lags_used());
        let input = plant.sample(self.period).input;
        // In modal coordinates a request acts on the drive of its own mode, one of the first six states.
        let request: [Vec<f64>; 6] = core::array::from_fn(|i| {
            (0..size).map(|state| (closed[(i, state)] - open[(i, state)]) / input[i][i]).collect()
        });
        let mut found: [Vec<[f64; 2]>; 6] = Default::default();
        for hertz in frequencies {
            let angle = TAU * hertz * self.period;
            let z = [libm::cos(angle), libm::sin(angle)];
            let mut rows: Vec<Vec<Complex>> = (0..size)
                .map(|i| {
                    let of =
                        |j: usize| [if i == j { z[0] } else { 0.0 } - open[(i, j)], if i == j { z[1] } else { 0.0 }];
                    let right = |k: usize| [input.get(i).map_or(0.0, |row| row[k]), 0.0];
                    (0..size).map(of).chain((0..6).map(right)).collect()
                })
                .collect();
            solve(&mut rows);
            // Modal, then along each axis: the diagonal of V L V⁻¹.
            let modal: [[Complex; 6]; 6] = core::array::from_fn(|i| {
                core::array::from_fn(|k| {
                    (0..size).fold([0.0; 2], |sum, state| {
                        let x = rows[state][size + k];
                        [sum[0] - request[i][state] * x[0], sum[1] - request[i][state] * x[1]]
                    })
                })
            });
            for (axis, list) in found.iter_mut().enumerate() {
                let mut value = [0.0; 2];
                for (i, row) in modal.iter().enumerate() {
                    for (k, entry) in row.iter().enumerate() {
                        let factor = self.basis.from_modal[axis][i] * self.basis.to_modal[k][axis];
                        value = [value[0] + factor * entry[0], value[1] + factor * entry[1]];
                    }
                }
                let mut phase = libm::atan2(value[1], value[0]).to_degrees();
                let last = list.last().map_or(-90.0, |point: &[f64; 2]| point[1]);
                phase -= 360.0 * libm::rint((phase - last) / 360.0);
                list.push([libm::hypot(value[0], value[1]), phase]);
            }
        }
        found
    }
}

/// Gaussian elimination with partial pivoting: the columns after the square are multiplied by its inverse.
pub(super) fn solve(rows: &mut [Vec<Complex>]) {
    let size = rows.len();
    let square = |v: Complex| v[0] * v[0] + v[1] * v[1];
    for column in 0..size {
        let pivot = (column + 1..size)
            .fold(column, |best, row| if square(rows[row][column]) > square(rows[best][column]) { row } else { best });
        rows.swap(column, pivot);
        let [re, im] = rows[column][column];
        let norm = square([re, im]);
        for value in &mut rows[column][column..] {
            *value = [(value[0] * re + value[1] * im) / norm, (value[1] * re - value[0] * im) / norm];
        }
        let own = rows[column].clone();
        for (row, values) in rows.iter_mut().enumerate() {
            let [re, im] = values[column];
            if row == column || (re == 0.0 && im == 0.0) {
                continue;
            }
            for (value, from) in values[column..].iter_mut().zip(&own[column..]) {
                *value = [value[0] - re * from[0] + im * from[1], value[1] - re * from[1] - im * from[0]];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_behind_the_square_become_what_solves_it() {
        // (2 + i) x = 5 and, after a row swap, x + y = 1.
        let mut rows = vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]], vec![[2.0, 1.0], [0.0, 0.0], [5.0, 0.0]]];
        solve(&mut rows);
        let close = |a: Complex, b: Complex| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12;
        assert!(close(rows[0][2], [2.0, -1.0]) && close(rows[1][2], [0.0, 2.0]));
    }
}
