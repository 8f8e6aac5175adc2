//! Measured response of each mode, compared with the model.

use std::f64::consts::TAU;

use serde::Serialize;
use specgen_numerics::nyquist::square;

use super::convergence::Learnable;
use super::response::Response;
use specgen_numerics::complex6::Matrix6c;

/// Measured response of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ModeMeasurement {
    /// Natural frequency by the model, Hz.
    pub frequency: f64,
    /// Frequency (Hz) and size of the peak in its response to its own correction, between half and one and a half times `frequency`.
    pub largest: [f64; 2],
    /// The same by the model.
    pub modelled: [f64; 2],
    /// Relative standard error at the peak.
    pub error: f64,
}

impl Learnable {
    /// The measured response of each mode.
    pub fn mode_measurements(&self, response: &Response) -> [ModeMeasurement; 6] {
        let frequencies: Vec<f64> = response.bins.iter().map(|bin| bin.hertz).collect();
        let model = self.nominal(&frequencies);
        std::array::from_fn(|mode| {
            let frequency = self.closed_loop.basis.frequencies[mode] / TAU;
            let near: Vec<usize> =
                (0..frequencies.len()).filter(|k| (frequencies[*k] / frequency - 1.0).abs() <= 0.5).collect();
            let gain = |matrix: &Matrix6c| libm::sqrt(square(matrix[mode][mode]));
            let largest = |gains: &dyn Fn(usize) -> f64| {
                near.iter()
                    .copied()
                    .max_by(|a, b| gains(*a).total_cmp(&gains(*b)))
                    .map_or((0, [frequency, 0.0]), |k| (k, [frequencies[k], gains(k)]))
            };
            let (at, measured) = largest(&|k| gain(&response.bins[k].response));
            let (_, modelled) = largest(&|k| gain(&model[k]));
            ModeMeasurement {
                frequency,
                largest: measured,
                modelled,
                error: response.bins[at].error[mode][mode] / measured[1],
            }
        })
    }
}
