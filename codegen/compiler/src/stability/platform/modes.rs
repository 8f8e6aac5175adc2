//! Modes of the platform on its legs: K v = ω² M v with K = Jᵀ k_a J at rest.

use super::RestDynamics;
use specgen_numerics::{Matrix6, generalized_modes, inverse_of_modes, multiply6, transpose6};

/// Relative coupling below which it is only rounding. Uncoupled modes are kept exactly decoupled, which splits the closed loop into
/// small blocks.
const UNCOUPLED: f64 = 1e-12;

/// Modal coordinates z = V⁻¹ x of the pose from rest, Vᵀ M V = I.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalBasis {
    /// ω in ascending order, rad/s.
    pub frequencies: [f64; 6],
    /// V: modal → pose coordinates; column i is mode i.
    pub from_modal: Matrix6,
    /// V⁻¹ = Vᵀ M.
    pub to_modal: Matrix6,
    /// diag(K), N/m and N m/rad.
    pub axis_stiffness: [f64; 6],
}

impl ModalBasis {
    /// None if M is not positive definite, or a motion has no stiffness.
    pub fn of(plant: &RestDynamics, axial_stiffness: f64) -> Option<Self> {
        let gram = multiply6(&transpose6(&plant.jacobian), &plant.jacobian);
        let stiffness = gram.map(|row| row.map(|x| x * axial_stiffness));
        let (squares, from_modal) = generalized_modes(&stiffness, &plant.mass)?;
        // Rounding gives a free motion a stiffness of about 1e-16 of the largest.
        let held = squares.iter().all(|square| *square > 1e-12 * squares[5]);
        held.then(|| Self {
            frequencies: squares.map(libm::sqrt),
            from_modal: from_modal.map(clean),
            to_modal: inverse_of_modes(&from_modal, &plant.mass),
            axis_stiffness: core::array::from_fn(|axis| stiffness[axis][axis]),
        })
    }

    /// Vᵀ diag(d) V: a diagonal force law in pose coordinates, in modal coordinates.
    pub fn couple(&self, diagonal: &[f64; 6]) -> Matrix6 {
        let scaled: Matrix6 = core::array::from_fn(|i| self.from_modal[i].map(|x| x * diagonal[i]));
        let mut coupled = multiply6(&transpose6(&self.from_modal), &scaled);
        let magnitude: [f64; 6] = core::array::from_fn(|i| libm::sqrt(coupled[i][i].abs()));
        for (i, row) in coupled.iter_mut().enumerate() {
            for (j, x) in row.iter_mut().enumerate() {
                if x.abs() <= UNCOUPLED * magnitude[i] * magnitude[j] {
                    *x = 0.0;
                }
            }
        }
        coupled
    }

    /// V⁻¹ K⁻¹ = diag(ω⁻²) Vᵀ, applied to one axis of a wrench: the leg motion that it requests, in modal coordinates.
    pub fn compliance(&self, axis: usize) -> [f64; 6] {
        core::array::from_fn(|i| self.from_modal[axis][i] / (self.frequencies[i] * self.frequencies[i]))
    }
}

/// A row of V with rounding errors set to zero.
fn clean(row: [f64; 6]) -> [f64; 6] {
    let largest = row.iter().fold(0.0, |a: f64, x| if x.abs() > a { x.abs() } else { a });
    row.map(|x| if x.abs() <= UNCOUPLED * largest { 0.0 } else { x })
}
