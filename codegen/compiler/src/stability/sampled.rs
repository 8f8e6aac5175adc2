//! Spectral radius of one leg under run-to-run adaptation, with amplifier lag, axial resonance and lag of its gauge.
//!
//! State at the end of a run: [p, y, v, g, δ̂, φ̂] with amplifier output p, displacement y, velocity v and reading of the gauge
//! g (all as displacement). If the gauge does not lag, g is y and not a state.
//! Over a run the request q̂ = −δ̂ − φ̂ is held:
//!
//! ```text
//! τ ṗ = λ q̂ − p ;   ÿ + 2ζω ẏ + ω² y = ω² p         discretised exactly over the run
//! τ_g ġ = y − g
//! m = g − q̂ ;  δ̂ ← ω1 m + (1−ω1) δ̂ ;  φ̂ ← ω2 (m − δ̂_old) + (1−ω2) φ̂
//! ```

use core::f64::consts::TAU;

use specgen_language::model::Model;
use specgen_numerics::{Matrix, exponential, spectral_radius as largest_magnitude, steady_covariances};

/// Linear dynamics of a leg in the adaptation loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegDynamics {
    /// Duration of a run, s.
    pub run: f64,
    /// Amplifier lag τ, s, ≥ 0.
    pub lag: f64,
    /// Lag of the gauge and its filter, s, ≥ 0.
    pub gauge_lag: f64,
    /// ω of the axial resonance, rad/s.
    pub resonance: f64,
    /// ζ.
    pub damping_ratio: f64,
}

impl LegDynamics {
    /// The leg of a spec.
    pub fn of(model: &Model) -> Self {
        Self {
            run: model.timing.period * f64::from(model.adaptation.run_interval),
            lag: model.amplifier.lag,
            gauge_lag: model.sensor.lag,
            resonance: TAU * model.actuator.resonance,
            damping_ratio: model.actuator.damping_ratio,
        }
    }

    /// State transition of [p, y, v, g] over one run, and in the last column its response to a held input. Without a lag of
    /// the gauge there is no g.
    fn discretise(&self) -> Matrix {
        // A lag far below the run is negligible; the bound keeps the matrix exponential well scaled.
        let shortest = self.shortest();
        let lag = if self.lag > shortest { self.lag } else { shortest };
        let stiffness = self.resonance * self.resonance;
        let damping = 2.0 * self.damping_ratio * self.resonance;
        // [A B; 0 0], velocity in units of ω y to balance the rows.
        let input = self.states();
        let mut continuous = Matrix::zeros(input + 1);
        continuous[(0, 0)] = -1.0 / lag;
        continuous[(0, input)] = 1.0 / lag;
        continuous[(1, 2)] = self.resonance;
        continuous[(2, 0)] = stiffness / self.resonance;
        continuous[(2, 1)] = -stiffness / self.resonance;
        continuous[(2, 2)] = -damping;
        if input > 3 {
            continuous[(3, 1)] = 1.0 / self.gauge_lag;
            continuous[(3, 3)] = -1.0 / self.gauge_lag;
        }
        exponential(&continuous.scaled(self.run))
    }

    fn shortest(&self) -> f64 {
        1e-4 * self.run
    }

    /// Number of states of the leg: three, and a fourth if the gauge lags.
    fn states(&self) -> usize {
        if self.gauge_lag > self.shortest() { 4 } else { 3 }
    }
}

/// Spectral radius of the loop from run to run, infinite if it cannot be found; `drift_weight` none for EWMA.
pub fn spectral_radius(dynamics: &LegDynamics, level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> f64 {
    largest_magnitude(&transition(dynamics, level_weight, drift_weight, gain_ratio))
}

/// The loop from run to run as a matrix over [p, y, v, g, δ̂, φ̂], φ̂ left out for EWMA and g without a lag of the gauge.
pub fn transition(dynamics: &LegDynamics, level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> Matrix {
    let discrete = dynamics.discretise();
    let leg = dynamics.states();
    let states = leg + if drift_weight.is_some() { 2 } else { 1 };
    let mut one_run = Matrix::zeros(states);
    // Estimates after the reading: m = g + δ̂ + φ̂ (φ̂ = 0 under EWMA).
    let level_row = estimate_row(leg, states, [level_weight, 1.0, level_weight]);
    one_run.set_row(leg, &level_row);
    let mut request_row: Vec<f64> = level_row.iter().map(|x| -x).collect();
    if let Some(weight) = drift_weight {
        let drift_row = estimate_row(leg, states, [weight, 0.0, 1.0]);
        one_run.set_row(leg + 1, &drift_row);
        for (request, drift) in request_row.iter_mut().zip(&drift_row) {
            *request -= drift;
        }
    }
    for row in 0..leg {
        let input = discrete[(row, leg)];
        for column in 0..states {
            let own = if column < leg { discrete[(row, column)] } else { 0.0 };
            one_run[(row, column)] = own + gain_ratio * input * request_row[column];
        }
    }
    one_run
}

/// Variance of a leg's reading at rest (m²) for unit variance of the gauge noise, and of the amplifier noise (as requested
/// displacement). The first is over runs with the weights of level and drift in use (none without adaptation), the second over ticks
/// of `period` (s) on the leg alone.
pub fn shown_at_rest(dynamics: &LegDynamics, weights: Option<(f64, Option<f64>)>, period: f64) -> [f64; 2] {
    let alone = LegDynamics { run: period, ..*dynamics };
    let discrete = alone.discretise();
    let leg = alone.states();
    let mut transition = Matrix::zeros(leg);
    let mut driven = Vec::with_capacity(leg);
    for row in 0..leg {
        transition.set_row(row, &discrete.row(row)[..leg]);
        driven.push(vec![discrete[(row, leg)]]);
    }
    let of = |transition: &Matrix, input: &[Vec<f64>], shown: usize| {
        let [covariance] = steady_covariances(transition, [input]);
        covariance[(shown, shown)]
    };
    let by_amplifier = of(&transition, &driven, shown(leg));
    let Some((level, drift)) = weights else { return [1.0, by_amplifier] };
    let (leg, closed) = (dynamics.states(), self::transition(dynamics, level, drift, 1.0));
    let discrete = dynamics.discretise();
    // An error of the reading acts like the measured state, through the estimates.
    let column = shown(leg);
    let own = |row: usize| if row < leg { discrete[(row, column)] } else { 0.0 };
    let input: Vec<Vec<f64>> = (0..closed.size()).map(|row| vec![closed[(row, column)] - own(row)]).collect();
    [1.0 + of(&closed, &input, column), by_amplifier]
}

/// Index of the measured state of a leg with so many states.
fn shown(leg: usize) -> usize {
    if leg > 3 { 3 } else { 1 }
}

/// Row of an estimate over the states, the first `leg` of which are the leg's, from its factors of reading, δ̂ and φ̂.
fn estimate_row(leg: usize, states: usize, [measured, level, drift]: [f64; 3]) -> Vec<f64> {
    let mut row = vec![0.0; leg];
    // The reading is its own state, or the displacement.
    row[shown(leg)] = measured;
    row.extend([level, drift]);
    row.truncate(states);
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: LegDynamics =
        LegDynamics { run: 1e-4, lag: 0.35e-3, gauge_lag: 0.0, resonance: TAU * 870.0, damping_ratio: 0.1 };

    /// Whether a disturbance decays, in a fine-step simulation of the same loop without the matrix exponential.
    fn settles(dynamics: &LegDynamics, level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> bool {
        let (mut p, mut y, mut v, mut g, mut level, mut drift) = (0.0, 1e-3, 0.0, 0.0, 0.0, 0.0);
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
                let middle = y + 0.5 * dt * dy;
                let (dp, dy, dv) = slope(p + 0.5 * dt * dp, middle, v + 0.5 * dt * dv);
                (p, y, v) = (p + dt * dp, y + dt * dy, v + dt * dv);
                g = if dynamics.gauge_lag == 0.0 {
                    y
                } else {
                    let ahead = g + 0.5 * dt * (middle - 0.5 * dt * dy - g) / dynamics.gauge_lag;
                    g + dt * (middle - ahead) / dynamics.gauge_lag
                };
            }
            let model_error = g - request;
            let old = level;
            level = level_weight * model_error + (1.0 - level_weight) * old;
            if let Some(weight) = drift_weight {
                drift = weight * (model_error - old) + (1.0 - weight) * drift;
            }
            // NaN does not settle.
            if y.is_nan() || y.abs() > 1.0 {
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
        for (run, gauge_lag) in [(5e-5, 0.0), (9e-5, 0.0), (2e-4, 0.0), (1e-3, 0.0), (9e-5, 15e-6), (9e-5, 0.3e-3)] {
            let dynamics = LegDynamics { run, gauge_lag, ..REFERENCE };
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
                        "run {run} s, lag of the gauge {gauge_lag} s, limit {low:.4}, × {factor}"
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
        let stiff = LegDynamics { run: 1.0, lag: 0.0, gauge_lag: 0.0, resonance: TAU * 100.0, damping_ratio: 0.7 };
        let limit = super::super::pcc_limit(0.252, 0.011);
        assert!(spectral_radius(&stiff, 0.252, Some(0.011), 0.99 * limit) < 1.0);
        assert!(spectral_radius(&stiff, 0.252, Some(0.011), 1.01 * limit) > 1.0);
    }
}
