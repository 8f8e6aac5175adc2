//! The platform between two ticks, sampled exactly: amplifier lag and six modes in modal coordinates.
//!
//! ```text
//! τ ṗ = d − p ;   z̈ + √κ diag(2 ζ ω) ż + (κ diag(ω²) + Vᵀ K_e V) z = κ diag(ω²) p
//! ```
//! d is the leg motion asked for, z the pose, both in modal coordinates; κ scales the axial stiffness of the legs while
//! their damping ratios stay, and K_e is the stiffness of a work piece that the platform touches.

use super::modes::ModalBasis;
use specgen_numerics::{Matrix, Matrix6, exponential};

/// States: lagged drive, displacement, velocity over ω, six each.
pub(super) const STATES: usize = 18;

/// The plant of one set of conditions.
#[derive(Debug, Clone)]
pub(super) struct Plant {
    /// [A B; 0 0] over [p, z, ż/ω, d], per s.
    continuous: Matrix,
}

impl Plant {
    /// `damping`: ζ of each mode; `contact`: Vᵀ K_e V, 1/s².
    pub(super) fn new(
        basis: &ModalBasis,
        damping: &[f64; 6],
        stiffness_factor: f64,
        contact: &Matrix6,
        lag: f64,
    ) -> Self {
        let mut continuous = Matrix::zeros(STATES + 6);
        for i in 0..6 {
            let frequency = basis.frequencies[i];
            let (drive, place, speed) = (i, 6 + i, 12 + i);
            continuous[(drive, drive)] = -1.0 / lag;
            continuous[(drive, STATES + i)] = 1.0 / lag;
            continuous[(place, speed)] = frequency;
            continuous[(speed, drive)] = stiffness_factor * frequency;
            continuous[(speed, place)] = -stiffness_factor * frequency;
            continuous[(speed, speed)] = -libm::sqrt(stiffness_factor) * 2.0 * damping[i] * frequency;
            for j in 0..6 {
                continuous[(speed, 6 + j)] -= contact[i][j] / frequency;
            }
        }
        Self { continuous }
    }

    /// State transition over `time` with the input held, and the response to that input (18 rows of 6).
    pub(super) fn sample(&self, time: f64) -> Sampled {
        let discrete = exponential(&self.continuous.scaled(time));
        let part = |first: usize, count: usize| {
            (0..STATES).map(|row| discrete.row(row)[first..first + count].to_vec()).collect()
        };
        Sampled { transition: part(0, STATES), input: part(STATES, 6) }
    }
}

/// x ← transition · x + input · d.
#[derive(Debug, Clone)]
pub(super) struct Sampled {
    pub(super) transition: Vec<Vec<f64>>,
    pub(super) input: Vec<Vec<f64>>,
}
