//! Play operators with rate-dependent thresholds, weighted and added.

/// A sum of play (backlash) operators, w_i · p_i.
///
/// Each follows `p ← max(v − r, min(v + r, p))` with r = r_i · (1 + κ ln(1 + |v̇| / v0)), where v̇ is the filtered rate of v.
/// A leg as built has every p at 0.
#[derive(Debug, Clone, PartialEq)]
pub struct PlayBank {
    /// r_i, V.
    pub(super) thresholds: Vec<f64>,
    pub(super) weights: Vec<f64>,
    /// p_i, V.
    pub(super) states: Vec<f64>,
    /// κ.
    pub(super) rate_sensitivity: f64,
    /// v0, V/s.
    pub(super) rate_scale: f64,
}

impl PlayBank {
    /// `thresholds` r_i in V (≥ 0), `weights` w_i (as many), `rate_sensitivity` κ, `rate_scale` v0 in V/s.
    #[must_use]
    pub fn new(thresholds: &[f64], weights: &[f64], rate_sensitivity: f64, rate_scale: f64) -> Self {
        Self {
            thresholds: thresholds.to_vec(),
            weights: weights.to_vec(),
            states: vec![0.0; thresholds.len()],
            rate_sensitivity,
            rate_scale,
        }
    }

    /// Factor on the thresholds at filtered rate `rate` (V/s).
    #[must_use]
    pub fn widening(&self, rate: f64) -> f64 {
        1.0 + self.rate_sensitivity * libm::log(1.0 + rate.abs() / self.rate_scale)
    }

    /// Moves to voltage `v` (V) with thresholds widened by a factor ≥ 1; returns the weighted sum (V).
    pub fn advance(&mut self, v: f64, widening: f64) -> f64 {
        for (state, threshold) in self.states.iter_mut().zip(&self.thresholds) {
            let r = threshold * widening;
            let (low, high) = (v - r, v + r);
            let raised = if *state < low { low } else { *state };
            *state = if raised > high { high } else { raised };
        }
        let mut sum = 0.0;
        for (state, weight) in self.states.iter().zip(&self.weights) {
            sum += weight * *state;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_play_moves_only_beyond_its_threshold_and_keeps_its_place_inside() {
        let mut bank = PlayBank::new(&[2.0], &[0.5], 0.0, 20.0);
        assert_eq!(bank.advance(1.5, 1.0), 0.0);
        assert_eq!(bank.advance(10.0, 1.0), 4.0);
        assert_eq!(bank.advance(6.5, 1.0), 4.0);
        assert_eq!(bank.advance(5.0, 1.0), 3.5);
    }

    #[test]
    fn the_threshold_widens_with_the_rate() {
        let mut bank = PlayBank::new(&[2.0], &[1.0], 0.5, 20.0);
        // 1 + 0.5 ln(1 + 20(e − 1)/20) = 1.5
        let rate = 20.0 * (core::f64::consts::E - 1.0);
        let widening = bank.widening(-rate);
        assert!((bank.advance(10.0, widening) - 7.0).abs() < 1e-12);
    }
}
