//! Spectral radius of one leg under run-to-run adaptation, with amplifier lag and axial resonance.
//!
//! State at the end of a run: [p, y, v, δ̂, φ̂] with amplifier output p, displacement y, velocity v (all as displacement).
//! Over a run the request q̂ = −δ̂ − φ̂ is held:
//!
//! ```text
//! τ ṗ = λ q̂ − p ;   ÿ + 2ζω ẏ + ω² y = ω² p         discretised exactly over the run
//! m = y − q̂ ;  δ̂ ← ω1 m + (1−ω1) δ̂ ;  φ̂ ← ω2 (m − δ̂_old) + (1−ω2) φ̂
//! ```

use core::f64::consts::TAU;

use specgen_language::model::Model;
use specgen_numerics::{Matrix, exponential, spectral_radius as largest_magnitude};

/// Linear dynamics of a leg as the adaptation sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegDynamics {
    /// Duration of a run, s.
    pub run: f64,
    /// Amplifier lag τ, s, ≥ 0.
    pub lag: f64,
    /// ω of the axial resonance, rad/s.
    pub resonance: f64,
    /// ζ.
    pub damping_ratio: f64,
}

impl LegDynamics {
    /// The leg of a spec.
    #[must_use]
    pub fn of(model: &Model) -> Self {
        Self {
            run: model.timing.period * f64::from(model.adaptation.run_interval),
            lag: model.amplifier.lag,
            resonance: TAU * model.actuator.resonance,
            damping_ratio: model.actuator.damping_ratio,
        }
    }

    /// State transition of [p, y, v] over one run, and in the fourth column its response to a held input.
    fn discretise(&self) -> Matrix {
        // A lag far below the run is as good as none; the bound keeps the matrix exponential well scaled.
        let shortest = 1e-4 * self.run;
        let lag = if self.lag > shortest { self.lag } else { shortest };
        let stiffness = self.resonance * self.resonance;
        let damping = 2.0 * self.damping_ratio * self.resonance;
        // [A B; 0 0], velocity in units of ω y to balance the rows.
        let mut continuous = Matrix::zeros(4);
        continuous.set_row(0, &[-1.0 / lag, 0.0, 0.0, 1.0 / lag]);
        continuous.set_row(1, &[0.0, 0.0, self.resonance, 0.0]);
        continuous.set_row(2, &[stiffness / self.resonance, -stiffness / self.resonance, -damping, 0.0]);
        exponential(&continuous.scaled(self.run))
    }
}

/// Spectral radius of the loop from run to run, infinite if it cannot be found; `drift_weight` none for EWMA.
#[must_use]
pub fn spectral_radius(dynamics: &LegDynamics, level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> f64 {
    largest_magnitude(&transition(dynamics, level_weight, drift_weight, gain_ratio))
}

/// The loop from run to run as a matrix over [p, y, v, δ̂, φ̂], φ̂ left out for EWMA.
#[must_use]
pub fn transition(dynamics: &LegDynamics, level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> Matrix {
    let discrete = dynamics.discretise();
    let states = if drift_weight.is_some() { 5 } else { 4 };
    let mut one_run = Matrix::zeros(states);
    // Estimates after the reading: m = y + δ̂ + φ̂ (φ̂ = 0 under EWMA).
    let level_row = estimate_row(states, [level_weight, 1.0, level_weight]);
    one_run.set_row(3, &level_row);
    let mut request_row: Vec<f64> = level_row.iter().map(|x| -x).collect();
    if let Some(weight) = drift_weight {
        let drift_row = estimate_row(states, [weight, 0.0, 1.0]);
        one_run.set_row(4, &drift_row);
        for (request, drift) in request_row.iter_mut().zip(&drift_row) {
            *request -= drift;
        }
    }
    for row in 0..3 {
        let input = discrete[(row, 3)];
        for column in 0..states {
            let own = if column < 3 { discrete[(row, column)] } else { 0.0 };
            one_run[(row, column)] = own + gain_ratio * input * request_row[column];
        }
    }
    one_run
}

/// Row of an estimate over [p, y, v, δ̂, φ̂]: its factors of y, δ̂ and φ̂.
fn estimate_row(states: usize, [measured, level, drift]: [f64; 3]) -> Vec<f64> {
    let row = [0.0, measured, 0.0, level, drift];
    row[..states].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: LegDynamics = LegDynamics { run: 1e-4, lag: 0.35e-3, resonance: TAU * 870.0, damping_ratio: 0.1 };

    /// Fine-step simulation of the same loop, independent of the matrix exponential: does a disturbance die out?
    fn settles(dynamics: &LegDynamics, level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> bool {
        let (mut p, mut y, mut v, mut level, mut drift) = (0.0, 1e-3, 0.0, 0.0, 0.0);
        let fine = 200;
        let dt = dynamics.run / f64::from(fine);
        let (w, z) = (dynamics.resonance, dynamics.damping_ratio);
        let mut late = 0.0_f64;
        let runs = 40_000;
        for run in 0..runs {
            let request: f64 = -level - drift;
            for _ in 0..fine {
                // Midpoint rule.
                let slope = |p: f64, y: f64, v: f64| {
                    ((gain_ratio * request - p) / dynamics.lag, v, w * w * (p - y) - 2.0 * z * w * v)
                };
                let (dp, dy, dv) = slope(p, y, v);
                let (dp, dy, dv) = slope(p + 0.5 * dt * dp, y + 0.5 * dt * dy, v + 0.5 * dt * dv);
                (p, y, v) = (p + dt * dp, y + dt * dy, v + dt * dv);
            }
            let model_error = y - request;
            let old = level;
            level = level_weight * model_error + (1.0 - level_weight) * old;
            if let Some(weight) = drift_weight {
                drift = weight * (model_error - old) + (1.0 - weight) * drift;
            }
            if y.abs() > 1.0 {
                return false;
            }
            if run > runs - 1000 {
                late = late.max(y.abs());
            }
        }
        late < 1e-4
    }

    #[test]
    fn radius_one_is_where_the_simulated_loop_stops_settling() {
        for run in [5e-5, 9e-5, 2e-4, 1e-3] {
            let dynamics = LegDynamics { run, ..REFERENCE };
            for drift in [None, Some(0.044)] {
                let radius = |weight: f64| spectral_radius(&dynamics, weight, drift.map(|d| d * weight), 1.0);
                let (mut low, mut high) = (1e-3, 4.0);
                for _ in 0..50 {
                    let middle: f64 = 0.5 * (low + high);
                    if radius(middle) < 1.0 { low = middle } else { high = middle }
                }
                for (factor, expected) in [(0.95, true), (1.05, false)] {
                    let weight = low * factor;
                    assert_eq!(
                        settles(&dynamics, weight, drift.map(|d| d * weight), 1.0),
                        expected,
                        "run {run} s, limit {low:.4}, × {factor}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_paper_s_weight_holds_up_to_about_11_kilohertz() {
        let radius =
            |rate: f64| spectral_radius(&LegDynamics { run: 1.0 / rate, ..REFERENCE }, 0.252, Some(0.011), 1.0);
        assert!(radius(11_000.0) < 1.0 && radius(11_600.0) > 1.0, "{} {}", radius(11_000.0), radius(11_600.0));
    }

    #[test]
    fn a_leg_without_dynamics_gives_the_jury_limit() {
        let stiff = LegDynamics { run: 1.0, lag: 0.0, resonance: TAU * 100.0, damping_ratio: 0.7 };
        let limit = super::super::pcc_limit(0.252, 0.011);
        assert!(spectral_radius(&stiff, 0.252, Some(0.011), 0.99 * limit) < 1.0);
        assert!(spectral_radius(&stiff, 0.252, Some(0.011), 1.01 * limit) > 1.0);
    }
}
