//! Linear parts of a leg, discretised exactly.

/// First-order lag with a smooth input whose rate is known: τ ẏ = u − y.
///
/// Exact for an input that is a cubic over a step, given by its values and rates at both ends. For an oscillation at ω
/// the error is at most (ω step)⁴/384 of its amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothLag {
    time_constant: f64,
    step: f64,
    /// Factors of the input's values at the beginning and the end of a step, and of its rates there.
    values: [f64; 2],
    rates: [f64; 2],
    output: f64,
}

impl SmoothLag {
    /// `time_constant` τ in s, > 0.
    pub fn new(time_constant: f64) -> Self {
        Self { time_constant, step: 0.0, values: [0.0; 2], rates: [0.0; 2], output: 0.0 }
    }

    /// Sets the length of the following steps, s.
    pub fn set_step(&mut self, step: f64) {
        if step.to_bits() == self.step.to_bits() {
            return;
        }
        self.step = step;
        // m_n = r ∫ e^(−r (1−s)) sⁿ ds over 0 to 1: m_0 = 1 − e^(−r), m_n = 1 − n m_(n−1)/r. The upward recursion loses
        // digits if r is small, the downward one if it is large.
        let r = step / self.time_constant;
        let mut moments = [-libm::expm1(-r), 0.0, 0.0, 0.0];
        if r > 4.0 {
            for n in 1..4 {
                moments[n] = 1.0 - n as f64 * moments[n - 1] / r;
            }
        } else {
            let mut above = 0.0;
            for n in (2..40).rev() {
                above = r * (1.0 - above) / n as f64;
                if n <= 4 {
                    moments[n - 1] = above;
                }
            }
        }
        let [m0, m1, m2, m3] = moments;
        let last = 3.0 * m2 - 2.0 * m3;
        self.values = [m0 - last, last];
        self.rates = [(m1 - 2.0 * m2 + m3) * step, (m3 - m2) * step];
    }

    /// Output now.
    pub fn output(&self) -> f64 {
        self.output
    }

    /// Rate of the output (1/s) at this input.
    pub fn rate(&self, input: f64) -> f64 {
        (input - self.output) / self.time_constant
    }

    /// Sets it to the steady state of this input.
    pub fn rest_at(&mut self, input: f64) {
        self.output = input;
    }

    /// One step over which the input goes from `before` to `after`, each as value and rate (1/s).
    pub fn advance(&mut self, before: [f64; 2], after: [f64; 2]) {
        // As differences from the output: a constant value keeps its bits.
        self.output += (self.values[0] * (before[0] - self.output) + self.values[1] * (after[0] - self.output))
            + (self.rates[0] * before[1] + self.rates[1] * after[1]);
    }
}

/// Underdamped resonance ẍ = ωn² (u − x) − 2 ζ ωn ẋ, gain 1 at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Resonance {
    natural: f64,
    damping: f64,
    position: f64,
    velocity: f64,
    transition: [[f64; 2]; 2],
}

impl Resonance {
    /// `frequency` fn in Hz (> 0), `damping` ζ in [0, 1).
    pub fn new(frequency: f64, damping: f64) -> Self {
        Self {
            natural: core::f64::consts::TAU * frequency,
            damping,
            position: 0.0,
            velocity: 0.0,
            transition: [[1.0, 0.0], [0.0, 1.0]],
        }
    }

    /// Sets the length of the following steps, s.
    pub fn set_step(&mut self, step: f64) {
        let sigma = self.damping * self.natural;
        let damped = self.natural * libm::sqrt(1.0 - self.damping * self.damping);
        let envelope = libm::exp(-sigma * step);
        let (sin, cos) = libm::sincos(damped * step);
        self.transition = [
            [envelope * (cos + sigma / damped * sin), envelope * sin / damped],
            [-envelope * self.natural * self.natural / damped * sin, envelope * (cos - sigma / damped * sin)],
        ];
    }

    /// Present position, in the unit of the input, and its rate, per s.
    pub fn motion(&self) -> [f64; 2] {
        [self.position, self.velocity]
    }

    /// Holds `input` for one step.
    pub fn advance(&mut self, input: f64) {
        let [[a, b], [c, d]] = self.transition;
        let offset = self.position - input;
        let velocity = self.velocity;
        self.position = input + (a * offset + b * velocity);
        self.velocity = c * offset + d * velocity;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_lag_follows_an_oscillation_as_the_closed_form_says_whatever_the_step() {
        // 10.6 µs is a corner of 15 kHz, 10 ms the longest lag of a spec.
        for (time_constant, frequency) in [(1e-7, 800.0), (10.6e-6, 800.0), (0.3e-3, 800.0), (10e-3, 10.0)] {
            let w = core::f64::consts::TAU * frequency;
            let wave = |time: f64| [libm::sin(w * time), w * libm::cos(w * time)];
            // y + τ ẏ = sin ωt from y(0) = 0.
            let (x, time) = (w * time_constant, 2e-3);
            let transient = x * libm::exp(-time / time_constant);
            let expected = (libm::sin(w * time) - x * libm::cos(w * time) + transient) / (1.0 + x * x);
            for (steps, bound) in [(20, 3e-4), (100, 5e-7), (2000, 3e-12)] {
                let mut lag = SmoothLag::new(time_constant);
                let step = time / f64::from(steps);
                lag.set_step(step);
                for k in 0..steps {
                    lag.advance(wave(f64::from(k) * step), wave(f64::from(k + 1) * step));
                }
                let off = (lag.output() - expected).abs();
                assert!(off < bound, "τ {time_constant}, {steps} steps: {off:e}");
            }
        }
    }

    #[test]
    fn a_smooth_lag_keeps_the_bits_of_what_stands_still() {
        for time_constant in [1e-6, 10.6e-6, 9e-3] {
            let mut lag = SmoothLag::new(time_constant);
            lag.set_step(2e-5);
            lag.rest_at(17.3e-6);
            for _ in 0..1000 {
                lag.advance([17.3e-6, 0.0], [17.3e-6, 0.0]);
            }
            assert_eq!(lag.output().to_bits(), 17.3e-6_f64.to_bits());
        }
    }

    #[test]
    fn a_resonance_rings_as_the_closed_form_says_whatever_the_step() {
        let (frequency, damping, time) = (870.0, 0.1, 1.7e-3);
        let natural = core::f64::consts::TAU * frequency;
        let damped = natural * libm::sqrt(1.0 - damping * damping);
        let phase = damped * time;
        let ring = libm::cos(phase) + damping * natural / damped * libm::sin(phase);
        let expected = 1.0 - libm::exp(-damping * natural * time) * ring;
        for steps in [1, 34, 1700] {
            let mut resonance = Resonance::new(frequency, damping);
            resonance.set_step(time / f64::from(steps));
            for _ in 0..steps {
                resonance.advance(1.0);
            }
            assert!((resonance.position - expected).abs() < 1e-10, "{steps}: {}", resonance.position);
        }
    }

    #[test]
    fn a_resonance_settles_at_its_input() {
        let mut resonance = Resonance::new(870.0, 0.1);
        resonance.set_step(5e-5);
        for _ in 0..20_000 {
            resonance.advance(3.0);
        }
        assert!((resonance.position - 3.0).abs() < 1e-12);
    }
}
