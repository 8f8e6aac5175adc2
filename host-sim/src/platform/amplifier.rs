//! Amplifier of one leg: first-order lag and a limited current into the capacitance of the stacks.

/// τ v̇ = u − v, but |v̇| ≤ I/C. Exact for a held input, in both regimes.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplifier {
    /// τ, s.
    pub(super) time_constant: f64,
    /// I/C, V/s.
    pub(super) slew: f64,
    /// Largest |u − v| without current limit, V.
    pub(super) reach: f64,
    step: f64,
    decay: f64,
    /// Stack voltage now, V.
    pub(super) voltage: f64,
}

impl Amplifier {
    /// `time_constant` τ in s (≥ 0; 0: only the current limit), `slew` = I/C in V/s (> 0, infinite for no limit).
    #[must_use]
    pub fn new(time_constant: f64, slew: f64) -> Self {
        let reach = if slew.is_finite() { slew * time_constant } else { f64::INFINITY };
        Self { time_constant, slew, reach, step: 0.0, decay: 0.0, voltage: 0.0 }
    }

    /// Sets the length of the following steps, s.
    pub fn set_step(&mut self, step: f64) {
        self.step = step;
        self.decay = if self.time_constant > 0.0 { libm::exp(-step / self.time_constant) } else { 0.0 };
    }

    /// Holds `input` (V) for one step; returns the stack voltage at its end.
    pub fn advance(&mut self, input: f64) -> f64 {
        let gap = self.voltage - input;
        // While the lag would exceed the limit, the voltage changes linearly.
        let excess = gap.abs() - self.reach;
        if excess <= 0.0 {
            self.voltage = input + gap * self.decay;
            return self.voltage;
        }
        let direction = if gap > 0.0 { -1.0 } else { 1.0 };
        let straight = excess / self.slew;
        if straight >= self.step {
            self.voltage += direction * self.slew * self.step;
        } else {
            let rest = -direction * self.reach;
            let decay =
                if self.time_constant > 0.0 { libm::exp(-(self.step - straight) / self.time_constant) } else { 0.0 };
            self.voltage = input + rest * decay;
        }
        self.voltage
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Voltage after `time` with `input` held, in `steps` steps.
    fn after(amplifier: &Amplifier, input: f64, time: f64, steps: u32) -> f64 {
        let mut amplifier = amplifier.clone();
        amplifier.set_step(time / f64::from(steps));
        for _ in 0..steps {
            amplifier.advance(input);
        }
        amplifier.voltage
    }

    #[test]
    fn a_large_step_runs_at_the_current_limit_and_then_settles_as_the_lag() {
        // 40 kV/s and 0.35 ms: the limit is active while the voltage is more than 14 V away.
        let amplifier = Amplifier::new(0.35e-3, 40e3);
        for steps in [1, 3, 100] {
            assert!((after(&amplifier, 100.0, 1e-3, steps) - 40.0).abs() < 1e-9, "{steps}");
            let expected = 100.0 - 14.0 * libm::exp(-(3e-3 - 86.0 / 40e3) / 0.35e-3);
            assert!((after(&amplifier, 100.0, 3e-3, steps) - expected).abs() < 1e-9, "{steps}");
        }
    }

    #[test]
    fn a_small_step_is_the_lag_alone_and_without_lag_only_the_current_counts() {
        let lag = Amplifier::new(0.35e-3, 40e3);
        let expected = 10.0 * (1.0 - libm::exp(-1.0));
        assert!((after(&lag, 10.0, 0.35e-3, 7) - expected).abs() < 1e-12);
        let current = Amplifier::new(0.0, 40e3);
        assert!((after(&current, -10.0, 0.1e-3, 7) + 4.0).abs() < 1e-12);
        assert_eq!(after(&current, -10.0, 1.0, 1), -10.0);
        let ideal = Amplifier::new(0.0, f64::INFINITY);
        assert_eq!(after(&ideal, 55.0, 1e-5, 1), 55.0);
    }
}
