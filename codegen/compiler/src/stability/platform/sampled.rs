//! The platform between two ticks, sampled exactly: amplifier lag, six modes and the lag of the gauges, in modal coordinates.
//!
//! ```text
//! τ ṗ = d − p ;   z̈ + √κ diag(2 ζ ω) ż + (κ diag(ω²) + Vᵀ K_e V) z = κ diag(ω²) p ;   τ_g ġ = z − g
//! ```
//! d is the requested leg motion, z the pose, g its reading, all in modal coordinates. κ scales the axial stiffness of the legs at
//! constant damping ratios, and K_e is the stiffness of a work piece that the platform touches. A structural mode adds an oscillator
//! ẅ + 2 ζ_n ω_n ẇ + ω_n² w = ω_n² s, with s the drive p of its legs, which becomes w, or the reading z of its gauges, which becomes
//! z − a (z − w − 2 ζ_n ẇ/ω_n).

use super::channel::StructuralChannel;
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
    states: usize,
}

/// Number of states of a plant whose gauges have this lag (s): without lag they read the displacement itself.
pub(super) fn states(gauge_lag: f64, structure: &[StructuralChannel]) -> usize {
    let own = if gauge_lag > 0.0 { SHOWN + 6 } else { SHOWN };
    own + structure.iter().map(|one| 2 * one.oscillators().len()).sum::<usize>()
}

/// First state of the readings.
pub(super) fn shown(gauge_lag: f64) -> usize {
    if gauge_lag > 0.0 { SHOWN } else { PLACE }
}

impl Plant {
    /// `damping`: ζ of each mode; `contact`: Vᵀ K_e V, 1/s²; `lags`: of the amplifier, > 0, and of the gauges, s, > 0 if a mode of the
    /// `structure` acts on them.
    pub(super) fn new(
        basis: &ModalBasis,
        damping: &[f64; 6],
        stiffness_factor: f64,
        contact: &Matrix6,
        [lag, gauge_lag]: [f64; 2],
        structure: &[StructuralChannel],
    ) -> Self {
        let states = states(gauge_lag, structure);
        let mut continuous = Matrix::zeros(states + 6);
        let unit = |first: usize| -> [Vec<f64>; 6] {
            core::array::from_fn(|i| (0..states).map(|state| f64::from(u8::from(state == first + i))).collect())
        };
        let (mut drive_rows, mut reading) = (unit(DRIVE), unit(PLACE));
        let mut first = states - structure.iter().map(|one| 2 * one.oscillators().len()).sum::<usize>();
        for one in structure {
            let rows = if one.on_readings() { &mut reading } else { &mut drive_rows };
            first = one.add_to(&mut continuous, rows, first);
        }
        for i in 0..6 {
            let frequency = basis.frequencies[i];
            let (drive, place, speed) = (DRIVE + i, PLACE + i, SPEED + i);
            continuous[(drive, drive)] = -1.0 / lag;
            continuous[(drive, states + i)] = 1.0 / lag;
            continuous[(place, speed)] = frequency;
            for (state, factor) in drive_rows[i].iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
                continuous[(speed, state)] += stiffness_factor * frequency * factor;
            }
            continuous[(speed, place)] = -stiffness_factor * frequency;
            continuous[(speed, speed)] = -libm::sqrt(stiffness_factor) * 2.0 * damping[i] * frequency;
            for j in 0..6 {
                continuous[(speed, PLACE + j)] -= contact[i][j] / frequency;
            }
            if gauge_lag > 0.0 {
                for (state, factor) in reading[i].iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
                    continuous[(SHOWN + i, state)] += factor / gauge_lag;
                }
                continuous[(SHOWN + i, SHOWN + i)] = -1.0 / gauge_lag;
            }
        }
        Self { continuous, states }
    }

    /// State transition over `time` with the input held, and the response to that input (six columns).
    pub(super) fn sample(&self, time: f64) -> DiscreteModel {
        let states = self.states;
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
