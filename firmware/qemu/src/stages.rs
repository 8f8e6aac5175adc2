//! What is counted beside the whole tick: the controller's own list of its parts, called on copies of the state.

use crate::instructions::InstructionCounter;
use crate::stats::Stage;
use controller::stages::{STAGE_COUNT, STAGES, prepare};
use controller::{Config, State, TickInput};

/// Counts so far.
pub struct Stages {
    /// The whole of `controller::step`, then [`STAGES`].
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

    /// Measures the parts for the tick that is about to be stepped. Nothing here touches the state that the replay steps.
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
                // SAFETY: a stage is a C function of these four words.
                count.add(unsafe { counter.measure_call(stage.run as *const (), arguments) });
            }
        }
    }

    /// All of them.
    pub fn all(&self) -> &[Stage] {
        &self.counts
    }
}
