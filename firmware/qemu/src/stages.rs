//! What is counted beside the whole tick: parts of the controller, called on copies.
//!
//! To add a stage: name it in [`Stages::new`] and measure it in [`Stages::measure`]. Nothing here may touch
//! the state that the replay steps.

use crate::instructions::InstructionCounter;
use crate::stats::Stage;
use controller::{Config, State, TickInput};

/// Stages in the order in which they are reported.
pub struct Stages {
    /// The whole of `controller::step`.
    step: Stage,
}

impl Stages {
    /// Nothing counted yet.
    pub const fn new() -> Self {
        Self {
            step: Stage::new("step"),
        }
    }

    /// Adds one tick of `controller::step`.
    pub fn add_step(&mut self, instructions: u32) {
        self.step.add(instructions);
    }

    /// Measures the parts for the tick that is about to be stepped.
    #[inline(always)]
    pub fn measure(&mut self, _: &mut InstructionCounter, _: &Config, _: &State, _: &TickInput) {}

    /// All of them.
    pub fn all(&self) -> [Stage; 1] {
        [self.step]
    }
}
