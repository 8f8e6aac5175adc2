//! Counts of the parts of a tick in the controller's own list, called on copies of the state.

use crate::instructions::InstructionCounter;
use crate::stats::Stage;
use controller::stages::{STAGE_COUNT, STAGES, prepare};
use controller::{Config, State, TickInput};

/// The counts so far.
pub struct Stages {
    /// `controller::step`, then [`STAGES`].
    counts: [Stage; STAGE_COUNT + 1],
}

impl Stages {
    /// Nothing counted yet.
    pub const fn new() -> Self {
        let mut counts = [Stage::new("step"); STAGE_COUNT + 1];
        let mut index = 0;
        while index < STAGE_COUNT {
            counts[index + 1] = Stage::new(STAGES[index].name);
            index += 1;
        }
        Self { counts }
    }

    /// Adds one tick of `controller::step`.
    pub fn add_step(&mut self, instructions: u32) {
        self.counts[0].add(instructions);
    }

    /// Measures the parts for the next tick. The state of the replay is not changed.
    #[inline(never)]
    #[allow(unsafe_code)] // Stages are called from assembly that counts them.
    pub fn measure(&mut self, counter: &mut InstructionCounter, config: &Config, state: &State, input: &TickInput) {
        let mut prepared = *state;
        prepare(config, &mut prepared, input);
        for (stage, count) in STAGES.iter().zip(self.counts.iter_mut().skip(1)) {
            for leg in 0..stage.calls {
                let mut copy = prepared;
                let arguments =
                    [(&raw const *config) as usize, (&raw mut copy) as usize, (&raw const *input) as usize, leg];
                // SAFETY: a stage is a C function with these four words.
                count.add(unsafe { counter.measure_call(stage.run as *const (), arguments) });
            }
        }
    }

    /// All stages.
    pub fn all(&self) -> &[Stage] {
        &self.counts
    }
}
