//! Response of the loop to six inputs: a correction of the request, or an error of the motion.

use super::{Assembly, ClosedLoop, Conditions, Tuning, shown};
use specgen_numerics::nyquist::{Complex, times};
use specgen_numerics::{Matrix, Resolvent};
use specgen_runtime::{ControlMode, Law};

impl ClosedLoop {
    /// The matrix of a tick, and the effect of six inputs in modal coordinates on the states: a correction of the request, or an error
    /// of the readings.
    pub(in super::super) fn driven(
        &self,
        law: ControlMode,
        tuning: &Tuning,
        conditions: &Conditions,
        on_gauges: bool,
    ) -> (Matrix, Vec<[f64; 6]>) {
        let mut assembly = Assembly::new(self, law, tuning, conditions);
        assembly.on_gauges = on_gauges;
        assembly.driven()
    }

    /// Response of the readings at the end of an interval to the correction for that interval, both in modal coordinates, at each of
    /// the angles ωT_s: T(z) = z C (z − A)⁻¹ B of the transition A, row by row, as (real, imaginary).
    pub fn correction_response(
        &self,
        law: ControlMode,
        tuning: &Tuning,
        conditions: &Conditions,
        angles: &[f64],
    ) -> Vec<[[Complex; 6]; 6]> {
        let shown = shown(self.lags_used()[1]);
        let (transition, input) = self.driven(law, tuning, conditions, false);
        let mut resolvent = Resolvent::new(&transition, &input);
        let mut found = Vec::with_capacity(angles.len());
        for angle in angles {
            let z = [libm::cos(*angle), libm::sin(*angle)];
            let states = resolvent.at(z);
            found.push(core::array::from_fn(|i| core::array::from_fn(|j| times(z, states[shown + i][j]))));
        }
        found
    }

    /// S at each of the angles ωT_s, in modal coordinates: the error of the pose that feedback leaves, per error that the readings would
    /// have without it. S = I − C (z − A)⁻¹ B, with an error of the readings as the input; row by row, as (real, imaginary).
    pub fn sensitivity(&self, law: ControlMode, tuning: &Tuning, angles: &[f64]) -> Vec<[[Complex; 6]; 6]> {
        let shown = shown(self.lags_used()[1]);
        let (transition, input) = self.driven(law, tuning, &Conditions::NOMINAL, true);
        let mut resolvent = Resolvent::new(&transition, &input);
        let mut at = |angle: &f64| {
            let states = resolvent.at([libm::cos(*angle), libm::sin(*angle)]);
            let of = |i: usize, j: usize| [f64::from(i == j) - states[shown + i][j][0], -states[shown + i][j][1]];
            core::array::from_fn(|i| core::array::from_fn(|j| of(i, j)))
        };
        angles.iter().map(&mut at).collect()
    }

    /// Readings at the end of each interval under open-loop requests, all in modal coordinates, from rest.
    pub fn without_feedback(&self, requests: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let law = ControlMode::F(Law::Invhys);
        let (transition, input) = self.driven(law, &Tuning::NONE, &Conditions::NOMINAL, false);
        let shown = shown(self.lags_used()[1]);
        let mut found = Vec::with_capacity(requests.len());
        over_time(&transition, &input, requests, |states| {
            found.push(core::array::from_fn(|mode| states[shown + mode]));
        });
        found
    }

    /// Closed-loop error for an error that the readings would have at the start of each interval without feedback, from rest, all in
    /// modal coordinates.
    pub fn left(&self, law: ControlMode, tuning: &Tuning, errors: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let (transition, input) = self.driven(law, tuning, &Conditions::NOMINAL, true);
        let shown = shown(self.lags_used()[1]);
        let mut given = errors.iter();
        let mut last = [0.0; 6];
        let mut found = Vec::with_capacity(errors.len());
        over_time(&transition, &input, errors, |states| {
            // The reading is the error plus the effect of earlier feedback.
            if let Some(error) = given.next() {
                found.push(core::array::from_fn(|mode| error[mode] - last[mode]));
            }
            last = core::array::from_fn(|mode| states[shown + mode]);
        });
        found
    }
}

/// The states after each interval, from rest, of six inputs.
fn over_time(transition: &Matrix, input: &[[f64; 6]], inputs: &[[f64; 6]], mut seen: impl FnMut(&[f64])) {
    // Most states depend on a few.
    let rows: Vec<Vec<(usize, f64)>> = (0..transition.size())
        .map(|row| transition.row(row).iter().copied().enumerate().filter(|(_, factor)| *factor != 0.0).collect())
        .collect();
    let mut states = vec![0.0; rows.len()];
    let mut next = states.clone();
    for given in inputs {
        for ((next, row), input) in next.iter_mut().zip(&rows).zip(input) {
            let kept: f64 = row.iter().map(|(column, factor)| factor * states[*column]).sum();
            let driven: f64 = input.iter().zip(given).map(|(factor, value)| factor * value).sum();
            *next = kept + driven;
        }
        core::mem::swap(&mut states, &mut next);
        seen(&states);
    }
}
