//! Threshold-creep operators, weighted and added.

/// Creep operators ċ = a_j · dead(v − c, r_k) for every rate a_j and threshold r_k,
/// where dead(x, r) is x − r above r, x + r below −r and 0 between.
///
/// The weight of a rate is divided equally among its thresholds: Σ_j w_j · mean_k c_jk. A leg as built has every c at
/// 0.
#[derive(Debug, Clone, PartialEq)]
pub struct CreepBank {
    /// a_j, 1/s.
    pub(super) rates: Vec<f64>,
    pub(super) weights: Vec<f64>,
    /// r_k, V.
    pub(super) thresholds: Vec<f64>,
    /// c_jk, V: a row per rate, a column per threshold.
    pub(super) states: Vec<f64>,
    /// 1 − e^(−a_j dt), per rate.
    gains: Vec<f64>,
}

impl CreepBank {
    /// `rates` a_j in 1/s, `weights` w_j (as many), `thresholds` r_k in V (≥ 0, at least one).
    #[must_use]
    pub fn new(rates: &[f64], weights: &[f64], thresholds: &[f64]) -> Self {
        Self {
            rates: rates.to_vec(),
            weights: weights.to_vec(),
            thresholds: thresholds.to_vec(),
            states: vec![0.0; rates.len() * thresholds.len()],
            gains: vec![0.0; rates.len()],
        }
    }

    /// Sets the length of the following steps, s.
    pub fn set_step(&mut self, step: f64) {
        for (gain, rate) in self.gains.iter_mut().zip(&self.rates) {
            *gain = -libm::expm1(-rate * step);
        }
    }

    /// Holds voltage `v` (V) for one step; returns the weighted sum (V). Exact for a held voltage.
    pub fn advance(&mut self, v: f64) -> f64 {
        let share = 1.0 / self.thresholds.len() as f64;
        let mut sum = 0.0;
        for ((row, gain), weight) in self.states.chunks_mut(self.thresholds.len()).zip(&self.gains).zip(&self.weights) {
            for (state, threshold) in row.iter_mut().zip(&self.thresholds) {
                *state += gain * dead(v - *state, *threshold);
                sum += weight * share * *state;
            }
        }
        sum
    }
}

/// Dead zone of half-width `r` ≥ 0.
fn dead(x: f64, r: f64) -> f64 {
    if x > r {
        x - r
    } else if x < -r {
        x + r
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_voltage_is_approached_to_within_the_threshold_at_the_stated_rate() {
        let mut bank = CreepBank::new(&[2.0], &[1.0], &[6.0]);
        bank.set_step(0.01);
        let mut last = 0.0;
        for _ in 0..50 {
            last = bank.advance(16.0);
        }
        // Exact: 10 (1 − e^(−2 · 0.5)).
        assert!((last - 10.0 * (1.0 - libm::exp(-1.0))).abs() < 1e-12, "{last}");
        assert_eq!(bank.advance(last + 5.0), last);
    }

    #[test]
    fn the_weight_of_a_rate_is_shared_by_its_thresholds() {
        let mut bank = CreepBank::new(&[1e9], &[0.5], &[0.0, 6.0]);
        bank.set_step(1.0);
        assert!((bank.advance(10.0) - 0.5 * (10.0 + 4.0) / 2.0).abs() < 1e-12);
    }
}
