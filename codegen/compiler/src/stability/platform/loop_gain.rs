//! The open loop as a matrix of six modes at one frequency: L = P C, from minus the readings to the readings, in modal coordinates.
//!
//! ```text
//! u = K⁻¹ (k_p + T k_I/e) N x ;   C x = u + A N (x + z⁻¹ u) + K⁻¹ k_v V x + D x        e = 1 − z⁻¹, x = −g
//! A = ω1/e (EWMA), (ω1 (e + z⁻¹ ω2) + ω2 e)/e² (PCC) ;   V = (1 − a) e/(T (1 − a z⁻¹))
//! P = G diag(p) H        p: each mode, sampled; H, G: structural modes of the legs and of what the gauges see
//! ```

use core::f64::consts::TAU;

use nalgebra::Complex;

use super::closed_loop::{ClosedLoop, Conditions};
use super::law::Tuning;
use super::notch::Biquad;
use super::sampled::{PLACE, Plant, shown};
use specgen_numerics::{ComplexMatrix, Matrix6, complex_eigenvalues, product};
use specgen_runtime::{ControlMode, Law};

fn complex(matrix: &Matrix6, factor: Complex<f64>) -> ComplexMatrix {
    ComplexMatrix::from_fn(|i, j| factor * matrix[i][j])
}

impl Biquad {
    /// H(z⁻¹).
    pub(super) fn at(&self, delay: Complex<f64>) -> Complex<f64> {
        let Self { b, a } = self;
        let square = delay * delay;
        (delay * b[1] + square * b[2] + b[0]) / (delay * a[0] + square * a[1] + 1.0)
    }
}

fn sections(sections: &[Biquad; 6], delay: Complex<f64>) -> ComplexMatrix {
    ComplexMatrix::from_diagonal(&nalgebra::Vector6::from_fn(|i, _| sections[i].at(delay)))
}

impl ClosedLoop {
    /// C at an angle ωT.
    pub(super) fn controller(&self, law: ControlMode, tuning: &Tuning) -> impl Fn(f64) -> ComplexMatrix {
        let gain = |gains: &[f64; 6]| self.requested_motion(&self.basis.couple(gains));
        let gains = [&tuning.proportional, &tuning.integral, &tuning.derivative].map(gain);
        move |angle| self.controller_at(law, tuning, &gains, angle)
    }

    fn controller_at(&self, law: ControlMode, tuning: &Tuning, gains: &[Matrix6; 3], angle: f64) -> ComplexMatrix {
        let (sin, cos) = libm::sincos(angle);
        let delay = Complex::new(cos, -sin);
        let e = Complex::new(1.0, 0.0) - delay;
        let period = self.period;
        let [proportional, integral, derivative] = gains;
        let notch = self.notch.as_ref().map_or_else(ComplexMatrix::identity, |notch| sections(&notch.sections, delay));
        let mut feedback = ComplexMatrix::zeros();
        if law.feeds_back() {
            let integral = complex(integral, Complex::new(period, 0.0) / e);
            feedback = product(&(complex(proportional, Complex::new(1.0, 0.0)) + integral), &notch);
        }
        let mut all = feedback;
        let [level, drift] = [tuning.level_bandwidth * period, tuning.drift_bandwidth * period];
        if law.law() != Law::Invhys && level != 0.0 {
            let estimate = if law.law() == Law::Pcc {
                ((e + delay * drift) * level + e * drift) / (e * e)
            } else {
                Complex::new(level, 0.0) / e
            };
            all += product(&notch, &(ComplexMatrix::identity() + feedback * delay)) * estimate;
        }
        if tuning.derivative != [0.0; 6] {
            let pole = libm::exp(-self.velocity_cutoff * period);
            let rate = e * ((1.0 - pole) / period) / (Complex::new(1.0, 0.0) - delay * pole);
            all += complex(derivative, rate);
        }
        match self.active_damping.as_ref().filter(|_| law.damps_modes()) {
            Some(damping) => all + sections(damping, delay),
            None => all,
        }
    }

    /// p of each mode at the angles ωT, with the amplifier's lag times `lag`: from a requested leg motion to the readings. Contact
    /// and λ are left out.
    pub(super) fn modal_responses(&self, conditions: &Conditions, lag: f64, angles: &[f64]) -> Vec<[Complex<f64>; 6]> {
        let [shortest, gauge_lag] =
            ClosedLoop { lag: lag * self.lag, structure: Vec::new(), ..self.clone() }.lags_used();
        let damping = self.damping.map(|ratio| ratio * conditions.damping);
        let plant = Plant::new(&self.basis, &damping, conditions.stiffness, &[[0.0; 6]; 6], [shortest, gauge_lag], &[]);
        let sampled = plant.sample(self.period);
        let seen = if shown(gauge_lag) == PLACE { 1 } else { 3 };
        let of = |mode: usize, angle: f64| {
            // Without contact a mode is decoupled from the others: every sixth state.
            let states: Vec<usize> = (mode..sampled.transition.len()).step_by(6).collect();
            let z = [libm::cos(angle), libm::sin(angle)];
            let mut rows: Vec<Vec<[f64; 2]>> = states
                .iter()
                .map(|&row| {
                    let of_column = |&column: &usize| {
                        let own = if row == column { z } else { [0.0; 2] };
                        [own[0] - sampled.transition[row][column], own[1]]
                    };
                    states.iter().map(of_column).chain([[sampled.input[row][mode], 0.0]]).collect()
                })
                .collect();
            super::open_loop::solve(&mut rows);
            let [re, im] = rows[seen][states.len()];
            let late = conditions.delay * angle;
            Complex::new(re, im) * Complex::new(libm::cos(late), -libm::sin(late))
        };
        angles.iter().map(|&angle| core::array::from_fn(|mode| of(mode, angle))).collect()
    }

    /// Eigenvalues of the open loop, as (real, imaginary), at the angles ωT. Contact and λ are left out.
    pub fn loci(
        &self,
        law: ControlMode,
        tuning: &Tuning,
        conditions: &Conditions,
        angles: &[f64],
    ) -> Vec<[[f64; 2]; 6]> {
        let (modes, controller) = (self.modal_responses(conditions, 1.0, angles), self.controller(law, tuning));
        let at = |(modes, &angle): (&[Complex<f64>; 6], &f64)| {
            complex_eigenvalues(&product(&self.plant_at(modes, angle), &controller(angle))).map(|one| [one.re, one.im])
        };
        modes.iter().zip(angles).map(at).collect()
    }

    /// P at the angle ωT from the response of each mode there.
    pub(super) fn plant_at(&self, modes: &[Complex<f64>; 6], angle: f64) -> ComplexMatrix {
        let frequency = angle / self.period;
        let mut plant = ComplexMatrix::from_diagonal(&nalgebra::Vector6::from_column_slice(modes));
        for one in &self.structure {
            let factor = one.at(frequency);
            plant = if one.on_readings() { factor * plant } else { plant * factor };
        }
        plant
    }
}

/// Hz of an angle ωT.
pub(super) fn hertz(angle: f64, period: f64) -> f64 {
    angle / (TAU * period)
}
