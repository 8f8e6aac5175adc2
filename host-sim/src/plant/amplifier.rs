//! Amplifiers of legs, a lane each: first-order lag and a limited current into the capacitance of the stacks.

use super::shape::{Lane, LateShape, StepShape};

/// τ v̇ = u − v, but |v̇| ≤ I/C. Exact for a held input, in both regimes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Amplifier<const N: usize> {
    /// τ, s.
    time_constant: Lane<N>,
    /// I/C, V/s.
    slew: Lane<N>,
    /// Largest |u − v| without current limit, V.
    reach: Lane<N>,
    step: f64,
    /// e^(−T/τ).
    decay: Lane<N>,
    /// Mean of the voltage over a step as a fraction of its change, and its first moment about the middle.
    mean: Lane<N>,
    skew: Lane<N>,
    late: LateShape<N>,
    /// Stack voltages now, V.
    pub(super) voltage: Lane<N>,
}

/// First moment about the middle of (1 − e^(−r s))/(1 − e^(−r)) for s from 0 to 1.
fn skew_of(r: f64) -> f64 {
    if r < 1e-2 {
        // Off by r²/720.
        return 1.0 / 12.0;
    }
    let decay = libm::exp(-r);
    let first = 0.5 - (1.0 - decay * (1.0 + r)) / (r * r);
    let mean = 1.0 - (1.0 - decay) / r;
    (first - 0.5 * mean) / (1.0 - decay)
}

impl<const N: usize> Amplifier<N> {
    /// `time_constant` τ in s (≥ 0; 0: only the current limit), `slew` = I/C in V/s (> 0, infinite for no limit).
    pub(crate) fn new(time_constant: Lane<N>, slew: f64) -> Self {
        let zero = [0.0; N];
        Self {
            time_constant,
            slew: [slew; N],
            reach: if slew.is_finite() { time_constant.map(|lag| slew * lag) } else { [f64::INFINITY; N] },
            step: 0.0,
            decay: zero,
            mean: zero,
            skew: zero,
            late: LateShape::NONE,
            voltage: zero,
        }
    }

    /// τ, s.
    pub(crate) fn time_constant(&self) -> &Lane<N> {
        &self.time_constant
    }

    /// Length of a step, s; 0 before the first [`Amplifier::set_step`].
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// Sets the length of the following steps, s.
    pub(super) fn set_step(&mut self, step: f64) {
        let lag = self.time_constant;
        self.step = step;
        self.decay = lag.map(|lag| if lag > 0.0 { libm::exp(-step / lag) } else { 0.0 });
        self.mean = std::array::from_fn(|k| 1.0 / (1.0 - self.decay[k]) - lag[k] / step);
        self.skew = lag.map(|lag| if lag > 0.0 { skew_of(step / lag) } else { 0.0 });
        self.late = LateShape::behind(&lag.map(|lag| if lag > 0.0 { step / lag } else { f64::INFINITY }));
    }

    /// Holds `input` (V) for one step.
    pub(super) fn advance(&mut self, input: &Lane<N>) {
        for (k, input) in input.iter().enumerate() {
            let gap = self.voltage[k] - input;
            // While the lag would exceed the limit, the voltage changes linearly.
            let excess = gap.abs() - self.reach[k];
            if excess <= 0.0 {
                self.voltage[k] = input + gap * self.decay[k];
                continue;
            }
            let direction = if gap > 0.0 { -1.0 } else { 1.0 };
            let straight = excess / self.slew[k];
            if straight >= self.step {
                self.voltage[k] += direction * self.slew[k] * self.step;
            } else {
                let (rest, lag) = (-direction * self.reach[k], self.time_constant[k]);
                let decay = if lag > 0.0 { libm::exp(-(self.step - straight) / lag) } else { 0.0 };
                self.voltage[k] = input + rest * decay;
            }
        }
    }

    /// Holds `input` (V) for one long step: the shape of the voltages over it, their mean, and how plays start late.
    // Inlined into functions that are compiled for several instruction sets.
    #[inline(always)]
    pub(super) fn advance_long(&mut self, input: &Lane<N>) -> (StepShape<N>, Lane<N>, LateShape<N>) {
        let before = self.voltage;
        let mut way = StepShape::REST;
        let mut mean = [0.0; N];
        let mut limited = false;
        for k in 0..N {
            let gap = before[k] - input[k];
            way.end[k] = input[k] + gap * self.decay[k];
            mean[k] = before[k] + (way.end[k] - before[k]) * self.mean[k];
            limited |= gap.abs() > self.reach[k];
        }
        let mut late = self.late;
        if limited {
            self.limited(input, &mut way, &mut mean, &mut late);
        }
        self.voltage = way.end;
        (way, mean, late)
    }

    /// Legs whose amplifiers are at their current limit, see [`Amplifier::advance`]: linear, then with the lag after
    /// the limit.
    fn limited(&self, input: &Lane<N>, way: &mut StepShape<N>, mean: &mut Lane<N>, late: &mut LateShape<N>) {
        for k in 0..N {
            let before = self.voltage[k];
            let gap = before - input[k];
            let excess = gap.abs() - self.reach[k];
            if excess <= 0.0 {
                continue;
            }
            let climb = if gap > 0.0 { -self.slew[k] } else { self.slew[k] } * self.step;
            // As a fraction of the step, as all times here.
            let time = excess / (self.slew[k] * self.step);
            let straight = if time < 1.0 { time } else { 1.0 };
            let left = 1.0 - straight;
            // The remaining change then, and after the lag.
            let (rest, lag) = (before + climb * straight - input[k], self.time_constant[k] / self.step);
            let decay = if lag > 0.0 { libm::exp(-left / lag) } else { 0.0 };
            let settled = left * straight * 0.5 + left * 0.5;
            let area =
                before * straight + climb * straight * straight * 0.5 + input[k] * left + rest * lag * (1.0 - decay);
            let moment = straight * straight * (before * 0.5 + climb * straight * (1.0 / 3.0))
                + input[k] * settled
                + rest * lag * (straight * (1.0 - decay) + lag * (1.0 - decay) - left * decay);
            way.end[k] = input[k] + rest * decay;
            if time >= 1.0 {
                way.end[k] = before + climb;
            }
            // Plays start late on the linear part, or on the other if that is longer.
            if lag == 0.0 || straight > 0.5 {
                late.straight(k, if lag == 0.0 { straight } else { 1.0 });
            }
            let change = way.end[k] - before;
            mean[k] = area;
            way.mean[k] = area - before - change * self.mean[k];
            way.skew[k] = moment - 0.5 * area - change * self.skew[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Voltage after `time` with `input` held, in `steps` steps.
    fn after(amplifier: &Amplifier<1>, input: f64, time: f64, steps: u32) -> f64 {
        let mut amplifier = amplifier.clone();
        amplifier.set_step(time / f64::from(steps));
        for _ in 0..steps {
            amplifier.advance(&[input]);
        }
        amplifier.voltage[0]
    }

    #[test]
    fn a_large_step_runs_at_the_current_limit_and_then_settles_as_the_lag() {
        // 40 kV/s and 0.35 ms: the limit is active while the voltage is more than 14 V away.
        let amplifier = Amplifier::new([0.35e-3], 40e3);
        for steps in [1, 3, 100] {
            assert!((after(&amplifier, 100.0, 1e-3, steps) - 40.0).abs() < 1e-9, "{steps}");
            let expected = 100.0 - 14.0 * libm::exp(-(3e-3 - 86.0 / 40e3) / 0.35e-3);
            assert!((after(&amplifier, 100.0, 3e-3, steps) - expected).abs() < 1e-9, "{steps}");
        }
    }

    #[test]
    fn a_small_step_is_the_lag_alone_and_without_lag_only_the_current_counts() {
        let expected = 10.0 * (1.0 - libm::exp(-1.0));
        for slew in [40e3, f64::INFINITY] {
            let lag = Amplifier::new([0.35e-3], slew);
            for steps in [1, 7, 1000] {
                assert!((after(&lag, 10.0, 0.35e-3, steps) - expected).abs() < 1e-12);
            }
        }
        let current = Amplifier::new([0.0], 40e3);
        assert!((after(&current, -10.0, 0.1e-3, 7) + 4.0).abs() < 1e-12);
        assert_eq!(after(&current, -10.0, 1.0, 1), -10.0);
        let ideal = Amplifier::new([0.0], f64::INFINITY);
        assert_eq!(after(&ideal, 55.0, 1e-5, 1), 55.0);
    }
}
