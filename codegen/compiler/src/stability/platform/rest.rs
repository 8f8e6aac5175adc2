//! The platform at rest, with the loop closed: what the noise of gauges and amplifiers makes of its pose.

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::{Law, Tuning};
use super::sampled::shown;
use specgen_numerics::{Matrix, Matrix6, multiply6, steady_covariances, transpose6};

impl ClosedLoop {
    /// Variance of the pose as the gauges show it (m², rad²), at rest under `law`: that made by the gauges, whose noise has the factor
    /// `gauges` in pose coordinates (columns are independent, of unit variance), and that made by the amplifiers, `amplifiers` likewise,
    /// in what the legs ask of the pose. Both are white from tick to tick, and a voltage is held over a tick. Hysteresis and the
    /// steps of the converters are left out.
    #[must_use]
    pub fn at_rest(&self, law: Law, tuning: &Tuning, gauges: &Matrix6, amplifiers: &Matrix6) -> [[f64; 6]; 2] {
        let modal = |factor: &Matrix6| multiply6(&self.basis.to_modal, factor);
        let (transition, request) = self.driven(law, tuning, &Conditions::NOMINAL, false);
        let (_, reading) = self.driven(law, tuning, &Conditions::NOMINAL, true);
        let inputs = [applied(&reading, &modal(gauges)), applied(&request, &modal(amplifiers))];
        let [by_gauges, by_amplifiers] = steady_covariances(&transition, [&inputs[0], &inputs[1]]);
        // The noise of a reading moves nothing before the next tick: it adds to what it has moved.
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

/// B G: what independent noise does to the states by way of six inputs.
fn applied(input: &[[f64; 6]], factor: &Matrix6) -> Vec<Vec<f64>> {
    let column = |row: &[f64; 6], k: usize| row.iter().zip(factor).fold(0.0, |sum, (x, row)| sum + x * row[k]);
    input.iter().map(|row| (0..6).map(|k| column(row, k)).collect()).collect()
}
