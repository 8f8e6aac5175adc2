//! Linear parts of a leg, discretised exactly for a held input.

/// First-order lag τ ẏ = u − y.
#[derive(Debug, Clone, PartialEq)]
pub struct Lag {
    time_constant: f64,
    decay: f64,
    /// Output now.
    pub(super) output: f64,
}

impl Lag {
    /// `time_constant` τ in s; 0 passes the input through.
    #[must_use]
    pub fn new(time_constant: f64) -> Self {
        Self { time_constant, decay: 0.0, output: 0.0 }
    }

    /// Fixes the length of the steps that follow, s.
    pub fn set_step(&mut self, step: f64) {
        self.decay = self.decay_over(step);
    }

    /// e^(−step/τ).
    pub(super) fn decay_over(&self, step: f64) -> f64 {
        if self.time_constant > 0.0 { libm::exp(-step / self.time_constant) } else { 0.0 }
    }

    /// Holds `input` for one step.
    pub fn advance(&mut self, input: f64) -> f64 {
        self.output = input + (self.output - input) * self.decay;
        self.output
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
    #[must_use]
    pub fn new(frequency: f64, damping: f64) -> Self {
        Self {
            natural: core::f64::consts::TAU * frequency,
            damping,
            position: 0.0,
            velocity: 0.0,
            transition: [[1.0, 0.0], [0.0, 1.0]],
        }
    }

    /// Fixes the length of the steps that follow, s.
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

    /// Position now, in the unit of the input.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.position
    }

    /// Holds `input` for one step; returns the position at its end.
    pub fn advance(&mut self, input: f64) -> f64 {
        let [[a, b], [c, d]] = self.transition;
        let offset = self.position - input;
        let velocity = self.velocity;
        self.position = input + (a * offset + b * velocity);
        self.velocity = c * offset + d * velocity;
        self.position
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_reaches_63_percent_in_one_time_constant_whatever_the_step() {
        for steps in [1, 7, 1000] {
            let mut lag = Lag::new(0.35e-3);
            lag.set_step(0.35e-3 / f64::from(steps));
            for _ in 0..steps {
                lag.advance(1.0);
            }
            assert!((lag.output - (1.0 - libm::exp(-1.0))).abs() < 1e-12);
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
            assert!((resonance.position() - expected).abs() < 1e-10, "{steps}: {}", resonance.position());
        }
    }

    #[test]
    fn a_resonance_settles_at_its_input() {
        let mut resonance = Resonance::new(870.0, 0.1);
        resonance.set_step(5e-5);
        for _ in 0..20_000 {
            resonance.advance(3.0);
        }
        assert!((resonance.position() - 3.0).abs() < 1e-12);
    }
}
