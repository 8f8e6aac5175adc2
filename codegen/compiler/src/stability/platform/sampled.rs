//! The platform between two ticks, sampled exactly: amplifier lag, six modes and the lag of the gauges, in modal coordinates.
//!
//! ```text
//! τ ṗ = d − p ;   z̈ + √κ diag(2 ζ ω) ż + (κ diag(ω²) + Vᵀ K_e V) z = κ diag(ω²) p ;   τ_g ġ = z − g
//! ```
//! d is the requested leg motion, z the pose, g its reading, all in modal coordinates. κ scales the axial stiffness of the legs at
//! constant damping ratios, and K_e is the stiffness of a work piece that the platform touches.

use super::modes::ModalBasis;
use specgen_numerics::{Matrix, Matrix6, exponential};

/// First state of each group of six: lagged drive, displacement, velocity over ω, and reading.
const DRIVE: usize = 0;
pub(super) const PLACE: usize = 6;
const SPEED: usize = 12;
const SHOWN: usize = 18;

/// The plant under one set of conditions.
#[derive(Debug, Clone)]
pub(super) struct Plant {
    /// [A B; 0 0] over [p, z, ż/ω, g, d], per s; g only if the gauges lag.
    continuous: Matrix,
    gauge_lag: f64,
}

/// Number of states of a plant whose gauges have this lag (s): without lag they read the displacement itself.
pub(super) fn states(gauge_lag: f64) -> usize {
    if gauge_lag > 0.0 { SHOWN + 6 } else { SHOWN }
}

/// First state of the readings.
pub(super) fn shown(gauge_lag: f64) -> usize {
    if gauge_lag > 0.0 { SHOWN } else { PLACE }
}

impl Plant {
    /// `damping`: ζ of each mode; `contact`: Vᵀ K_e V, 1/s²; `lags`: of the amplifier, > 0, and of the gauges, s.
    pub(super) fn new(
        basis: &ModalBasis,
        damping: &[f64; 6],
        stiffness_factor: f64,
        contact: &Matrix6,
        [lag, gauge_lag]: [f64; 2],
    ) -> Self {
        let states = states(gauge_lag);
        let mut continuous = Matrix::zeros(states + 6);
        for i in 0..6 {
            let frequency = basis.frequencies[i];
            let (drive, place, speed) = (DRIVE + i, PLACE + i, SPEED + i);
            continuous[(drive, drive)] = -1.0 / lag;
            continuous[(drive, states + i)] = 1.0 / lag;
            continuous[(place, speed)] = frequency;
            continuous[(speed, drive)] = stiffness_factor * frequency;
            continuous[(speed, place)] = -stiffness_factor * frequency;
            continuous[(speed, speed)] = -libm::sqrt(stiffness_factor) * 2.0 * damping[i] * frequency;
            for j in 0..6 {
                continuous[(speed, PLACE + j)] -= contact[i][j] / frequency;
            }
            if gauge_lag > 0.0 {
                continuous[(SHOWN + i, place)] = 1.0 / gauge_lag;
                continuous[(SHOWN + i, SHOWN + i)] = -1.0 / gauge_lag;
            }
        }
        Self { continuous, gauge_lag }
    }

    /// State transition over `time` with the input held, and the response to that input (six columns).
    pub(super) fn sample(&self, time: f64) -> DiscreteModel {
        let states = states(self.gauge_lag);
        let discrete = exponential(&self.continuous.scaled(time));
        let part = |first: usize, count: usize| {
            (0..states).map(|row| discrete.row(row)[first..first + count].to_vec()).collect()
        };
        DiscreteModel { transition: part(0, states), input: part(states, 6) }
    }
}

/// x ← transition · x + input · d.
#[derive(Debug, Clone)]
pub(super) struct DiscreteModel {
    pub(super) transition: Vec<Vec<f64>>,
    pub(super) input: Vec<Vec<f64>>,
}
