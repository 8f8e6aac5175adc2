//! Noise of the pose at rest in closed loop, from the noise of gauges and amplifiers.

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::sampled::shown;
use specgen_numerics::{Matrix, Matrix6, multiply6, steady_covariances, transpose6};
use specgen_runtime::ControlMode;

impl ClosedLoop {
    /// Variance of the measured pose (m², rad²) at rest under `law`: that due to the gauges, then that due to the amplifiers. `gauges`
    /// maps independent noise of unit variance (columns) to noise of the readings in pose coordinates; `amplifiers` maps it to noise of
    /// the pose that the legs request. Both are white from tick to tick, and a voltage is held over a tick. Hysteresis and the steps of
    /// the converters are not included.
    pub fn at_rest(&self, law: ControlMode, tuning: &Tuning, gauges: &Matrix6, amplifiers: &Matrix6) -> [[f64; 6]; 2] {
        let modal = |factor: &Matrix6| multiply6(&self.basis.to_modal, factor);
        let (transition, request) = self.driven(law, tuning, &Conditions::NOMINAL, false);
        let (_, reading) = self.driven(law, tuning, &Conditions::NOMINAL, true);
        let inputs = [applied(&reading, &modal(gauges)), applied(&request, &modal(amplifiers))];
        let [by_gauges, by_amplifiers] = steady_covariances(&transition, [&inputs[0], &inputs[1]]);
        // The noise of a reading moves the platform only from the next tick on, so the two are independent.
        let direct = multiply6(gauges, &transpose6(gauges));
        let of_states = |covariance: &Matrix| self.of_pose(covariance, shown(self.lags_used()[1]));
        let gauges = of_states(&by_gauges);
        [core::array::from_fn(|axis| gauges[axis] + direct[axis][axis]), of_states(&by_amplifiers)]
    }

    /// Variances of the pose from the covariance of six modal states, the first of which is `first`.
    fn of_pose(&self, covariance: &Matrix, first: usize) -> [f64; 6] {
        let modal: Matrix6 = core::array::from_fn(|i| core::array::from_fn(|j| covariance[(first + i, first + j)]));
        let from = &self.basis.from_modal;
        let pose = multiply6(&multiply6(from, &modal), &transpose6(from));
        core::array::from_fn(|axis| pose[axis][axis])
    }
}

/// B G: effect of independent noise on the states through six inputs.
fn applied(input: &[[f64; 6]], factor: &Matrix6) -> Vec<Vec<f64>> {
    let column = |row: &[f64; 6], k: usize| row.iter().zip(factor).fold(0.0, |sum, (x, row)| sum + x * row[k]);
    input.iter().map(|row| (0..6).map(|k| column(row, k)).collect()).collect()
}
