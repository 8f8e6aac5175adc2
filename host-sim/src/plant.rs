//! The simulated plant of a leg, from amplifier input to displacement. Amplifiers and stacks also drive a platform.
#![allow(clippy::needless_range_loop, reason = "lanes are indexed alike in several arrays")]

mod actuators;
mod amplifier;
mod bouc_wen;
mod bound;
mod filter;
mod leg;
mod parameters;
mod shape;
mod stack;

pub(crate) use actuators::Actuators;
pub use bouc_wen::BoucWenParameters;
pub(crate) use bound::Bound;
pub(crate) use filter::SmoothLag;
pub use leg::LegPlant;
pub(crate) use parameters::checked;
pub use parameters::{LegParameters, NoiseParameters, ParameterError, REFERENCE_LEG, SHIPPED};
pub(crate) use shape::StepShape;

/// Number of equal steps, none longer than `longest`, that make up `duration`; at least one. A ratio within 1e-9 of a
/// whole number counts as that number, so that 0.02 s is 400 steps of 50 µs.
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
