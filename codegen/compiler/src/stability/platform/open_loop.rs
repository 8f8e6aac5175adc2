//! The open loop, cut at the requested leg displacements.

use core::f64::consts::TAU;

use nalgebra::Complex;

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use specgen_runtime::ControlMode;

impl ClosedLoop {
    /// The open loop of each axis x to θz at `frequencies` (Hz, below half the tick rate), with the other axes open as well: gain
    /// (a ratio) and phase (degrees, unwrapped from that of the lowest frequency). With λ = 1, free of contact.
    pub fn open_loop(&self, law: ControlMode, tuning: &Tuning, frequencies: &[f64]) -> [Vec<[f64; 2]>; 6] {
        let angles: Vec<f64> = frequencies.iter().map(|hertz| TAU * hertz * self.period).collect();
        let responses = self.modal_responses(&Conditions::NOMINAL, 1.0, &angles);
        let controller = self.controller(law, tuning);
        let mut found: [Vec<[f64; 2]>; 6] = Default::default();
        for (modes, angle) in responses.iter().zip(angles) {
            // Modal, then along each axis: the diagonal of V L V⁻¹.
            let modal = controller(angle) * self.plant_at(modes, angle);
            for (axis, list) in found.iter_mut().enumerate() {
                let mut value = Complex::new(0.0, 0.0);
                for i in 0..6 {
                    for k in 0..6 {
                        value += modal[(i, k)] * (self.basis.from_modal[axis][i] * self.basis.to_modal[k][axis]);
                    }
                }
                let mut phase = libm::atan2(value.im, value.re).to_degrees();
                let last = list.last().map_or(-90.0, |point: &[f64; 2]| point[1]);
                phase -= 360.0 * libm::rint((phase - last) / 360.0);
                list.push([libm::hypot(value.re, value.im), phase]);
            }
        }
        found
    }
}

/// Gaussian elimination with partial pivoting: the columns after the square are multiplied by its inverse.
pub(super) fn solve(rows: &mut [Vec<[f64; 2]>]) {
    let size = rows.len();
    let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
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
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12;
        assert!(close(rows[0][2], [2.0, -1.0]) && close(rows[1][2], [0.0, 2.0]));
    }
}
