//! The simulated plant: one leg, from amplifier input to displacement.

mod bouc_wen;
mod bound;
mod creep;
mod filter;
pub(crate) mod lanes;
mod leg;
mod parameters;
mod play;
mod stack;

pub use bouc_wen::{BoucWen, BoucWenParameters};
pub(crate) use bound::Bound;
pub(crate) use filter::SmoothLag;
pub use leg::LegPlant;
pub(crate) use parameters::checked;
pub use parameters::{LegParameters, NoiseParameters, ParameterError, REFERENCE_LEG, SHIPPED};
pub use stack::Stack;

/// One leg with a held input voltage.
pub trait Plant {
    /// Holds `drive` (V, at the amplifier input, gain 1) for `interval` (s, > 0) and returns the
    /// displacement at its end (m, > 0 extends; relative to the leg as built, not to any gauge zero).
    fn hold(&mut self, drive: f64, interval: f64) -> f64;

    /// Present displacement, m, as last returned by [`Plant::hold`].
    fn displacement(&self) -> f64;

    /// Noise-free gauge signal, m.
    fn seen(&self) -> f64 {
        self.displacement()
    }

    /// Drives a straight line from `from` to `to` (V) in `duration` (s), as steps of `update` (s) or a little less,
    /// each at the value of its end, and returns the displacement at the end (m).
    fn ramp(&mut self, from: f64, to: f64, duration: f64, update: f64) -> f64 {
        let steps = steps_within(duration, update);
        let interval = duration / f64::from(steps);
        for step in 1..=steps {
            let fraction = f64::from(step) / f64::from(steps);
            self.hold(from + (to - from) * fraction, interval);
        }
        self.displacement()
    }
}

/// Number of equal steps, none longer than `longest`, that make up `duration`; at least one. A ratio within 1e-9 of a
/// whole number counts as that number, so that 0.02 s is 400 steps of 50 µs.
#[must_use]
pub(crate) fn steps_within(duration: f64, longest: f64) -> u32 {
    // `as` saturates, and a NaN becomes 0: both give a bounded count.
    (libm::ceil(duration / longest - 1e-9) as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_that_is_whole_but_for_rounding_makes_no_extra_step() {
        assert_eq!(steps_within(0.02, 5e-5), 400);
        assert_eq!(steps_within(0.02 * (1.0 + 1e-15), 5e-5), 400);
        assert_eq!(steps_within(0.0201, 5e-5), 402);
        assert_eq!(steps_within(1e-6, 5e-5), 1);
    }
}
