//! Bouc-Wen hysteresis: a second class of leg, smooth where plays have corners.

use serde::{Deserialize, Serialize};

use super::bound::Bound;

/// Parameters of a Bouc-Wen leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoucWenParameters {
    /// α: fraction of a small change of voltage that the hysteresis takes, in (0, 1).
    pub alpha: f64,
    /// β, 1/V, > 0.
    #[serde(rename = "beta_per_V")]
    pub beta_per_v: f64,
    /// γ, 1/V, above −β.
    #[serde(rename = "gamma_per_V")]
    pub gamma_per_v: f64,
}

impl BoucWenParameters {
    /// The same loop, wider and longer by `factor` (> 0).
    pub(super) fn widen(&mut self, factor: f64) {
        self.beta_per_v /= factor;
        self.gamma_per_v /= factor;
    }

    /// Findings about its values.
    pub(super) fn findings(&self) -> Vec<String> {
        let Self { alpha, beta_per_v, gamma_per_v } = *self;
        let ranges = [
            Bound::Above(0.0).and(Bound::Below(1.0), "bouc_wen.alpha", alpha),
            Bound::Above(0.0).and(Bound::AtMost(1e6), "bouc_wen.beta_per_V", beta_per_v),
            Bound::Above(-beta_per_v).and(Bound::AtMost(1e6), "bouc_wen.gamma_per_V", gamma_per_v),
        ];
        let found: Vec<String> = ranges.into_iter().flatten().collect();
        if found.is_empty() && self.steepest() >= 1.0 {
            let why = "the leg would shorten while its voltage rises: 2 alpha beta/(beta + gamma) is to be below 1";
            return vec![format!("`bouc_wen.alpha` is {alpha}; {why}")];
        }
        found
    }

    /// Steepest dh/dv, in a branch that continues the previous one: from 1 on the leg would shorten while its voltage
    /// rises.
    fn steepest(&self) -> f64 {
        let turned = 2.0 * self.alpha * self.beta_per_v / (self.beta_per_v + self.gamma_per_v);
        if turned > self.alpha { turned } else { self.alpha }
    }
}

/// x = v − h with dh = α dv − β |dv| h − γ dv |h| (exponent 1), exact for a voltage that is monotonic over a step; V.
///
/// Rate-independent. Loops are smooth and close only in the limit of many cycles, so no Everett table represents them.
/// As built, v and h are 0.
#[derive(Debug, Clone, PartialEq)]
pub struct BoucWen {
    of: BoucWenParameters,
    voltage: f64,
    /// h, V.
    lost: f64,
}

impl BoucWen {
    /// A leg as built, from checked parameters.
    pub fn new(of: BoucWenParameters) -> Self {
        Self { of, voltage: 0.0, lost: 0.0 }
    }

    /// x now, V.
    pub(super) fn output(&self) -> f64 {
        self.voltage - self.lost
    }

    /// dx/dv for a voltage in the direction of `way` from here.
    pub(super) fn slope(&self, way: f64) -> f64 {
        let BoucWenParameters { alpha, beta_per_v: beta, gamma_per_v: gamma } = self.of;
        let g = if way < 0.0 { -self.lost } else { self.lost };
        1.0 - (alpha - (if g < 0.0 { beta - gamma } else { beta + gamma }) * g)
    }

    /// Moves to voltage `v` (V); returns x (V).
    pub fn advance(&mut self, v: f64) -> f64 {
        let BoucWenParameters { alpha, beta_per_v: beta, gamma_per_v: gamma } = self.of;
        let way = v - self.voltage;
        let direction = if way < 0.0 { -1.0 } else { 1.0 };
        // g = h along the distance s ≥ 0: dg/ds = α − β g − γ |g|, which is linear on either side of 0 and rises
        // through it.
        let (mut g, mut left) = (direction * self.lost, way.abs());
        if g < 0.0 {
            let rate = beta - gamma;
            let slope = alpha - rate * g;
            let to_zero = time_of(rate, -g / slope);
            if to_zero >= left {
                g += slope * grown(rate, left);
                left = 0.0;
            } else {
                g = 0.0;
                left -= to_zero;
            }
        }
        let rate = beta + gamma;
        g += if left > 0.0 { (alpha - rate * g) * grown(rate, left) } else { 0.0 };
        self.voltage = v;
        self.lost = direction * g;
        v - self.lost
    }
}

/// ∫ e^(−rate s) ds from 0 to `way`.
fn grown(rate: f64, way: f64) -> f64 {
    if rate == 0.0 { way } else { -libm::expm1(-rate * way) / rate }
}

/// The distance after which [`grown`] is `value`; infinite if it is never reached.
fn time_of(rate: f64, value: f64) -> f64 {
    if rate == 0.0 {
        value
    } else if rate * value >= 1.0 {
        f64::INFINITY
    } else {
        -libm::log1p(-rate * value) / rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEG: BoucWenParameters = BoucWenParameters { alpha: 0.4, beta_per_v: 0.05, gamma_per_v: 0.02 };

    #[test]
    fn a_step_is_what_the_differential_equation_gives_in_many() {
        for gamma_per_v in [0.02, 0.05, -0.03, 0.08] {
            let parameters = BoucWenParameters { gamma_per_v, ..LEG };
            let mut exact = BoucWen::new(parameters);
            let (mut v, mut h) = (0.0, 0.0);
            for goal in [60.0, 12.0, 47.5, 30.0, 90.0, 0.0] {
                let found = exact.advance(goal);
                // Second order (midpoint) in 20,000 steps.
                let step: f64 = (goal - v) / 20_000.0;
                let slope =
                    |h: f64| parameters.alpha * step - LEG.beta_per_v * step.abs() * h - gamma_per_v * step * h.abs();
                for _ in 0..20_000 {
                    h += slope(h + 0.5 * slope(h));
                }
                v = goal;
                assert!((found - (v - h)).abs() < 1e-6, "γ {gamma_per_v}, {goal} V: {found} {}", v - h);
            }
        }
    }

    #[test]
    fn two_steps_on_the_way_are_as_good_as_one() {
        let (mut one, mut two) = (BoucWen::new(LEG), BoucWen::new(LEG));
        for goal in [80.0, 20.0, 70.0] {
            two.advance(0.5 * (two.voltage + goal));
            assert!((one.advance(goal) - two.advance(goal)).abs() < 1e-12);
        }
    }

    #[test]
    fn it_follows_the_voltage_whatever_came_before() {
        let mut leg = BoucWen::new(LEG);
        let mut last = leg.advance(0.0);
        for k in 1..2000 {
            let v = 50.0 - 50.0 * libm::cos(f64::from(k) * 0.37) * libm::cos(f64::from(k) * 0.011);
            let rises = v > leg.voltage;
            let next = leg.advance(v);
            assert_eq!(next > last, rises, "{k}");
            last = next;
        }
    }
}
