//! Amplifiers and stacks of legs, a lane each: from held voltages to free displacements.

use super::LegParameters;
use super::amplifier::Amplifier;
use super::shape::{Lane, StepShape};
use super::stack::Stack;

/// Amplifiers that drive stacks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Actuators<const N: usize> {
    amplifier: Amplifier<N>,
    stack: Stack<N>,
}

impl<const N: usize> Actuators<N> {
    /// As built, from checked parameters of at most N legs, with amplifiers of at most `slew` (V/s).
    pub(crate) fn new(legs: &[LegParameters], slew: f64) -> Self {
        let lags = std::array::from_fn(|k| legs.get(k).map_or(0.0, |leg| leg.tau_amp_s));
        Self { amplifier: Amplifier::new(lags, slew), stack: Stack::new(legs) }
    }

    /// Lags of the amplifiers, s.
    pub(crate) fn lags(&self) -> &Lane<N> {
        self.amplifier.time_constant()
    }

    /// Voltages of the stacks, V.
    pub(crate) fn voltages(&self) -> &Lane<N> {
        &self.amplifier.voltage
    }

    /// Length of a step, s.
    pub(crate) fn step(&self) -> f64 {
        self.amplifier.step()
    }

    /// Sets the length of the following steps, s.
    pub(crate) fn set_step(&mut self, step: f64) {
        if step.to_bits() != self.step().to_bits() {
            self.amplifier.set_step(step);
            self.stack.set_step(step);
        }
    }

    /// Sets the length of the following long steps, s.
    pub(crate) fn set_long_step(&mut self, step: f64) {
        self.set_step(step);
        self.stack.widen();
    }

    /// Holds `voltages` for one step: free displacements at its end, µm. The thresholds of plays follow the rate of the
    /// voltages if they are to `widen`.
    pub(crate) fn advance(&mut self, voltages: &Lane<N>, widen: bool) -> Lane<N> {
        let before = self.amplifier.voltage;
        self.amplifier.advance(voltages);
        self.stack.advance(&before, &self.amplifier.voltage, widen)
    }

    /// Holds `voltages` for one long step: free displacements over it, µm.
    // Inlined into functions that are compiled for several instruction sets.
    #[inline(always)]
    pub(crate) fn advance_long(&mut self, voltages: &Lane<N>) -> StepShape<N> {
        let before = self.amplifier.voltage;
        let (way, mean, late) = self.amplifier.advance_long(voltages);
        self.stack.advance_long(&before, &way, &mean, &late)
    }
}
