//! The supervised controller, stepped by a host, with the cost of each tick.

use controller::supervised::{
    MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Machine, MachineInput, machine_at_reset, machine_output_words,
};
use controller::{CONFIG_WORDS, Config, DESCRIPTION};
use specgen_link::{CostUnit, Stage, WORDS, lockstep};

use crate::counted::counted_tick;
use crate::instructions::InstructionCounter;
use crate::stages::Stages;

const _: () = assert!(CONFIG_WORDS <= WORDS && MACHINE_INPUT_WORDS <= WORDS && MACHINE_OUTPUT_WORDS <= WORDS);

/// Name of the stage of the whole tick.
const WHOLE: &str = "supervise";

/// A machine with its settings.
pub struct Steps {
    counter: InstructionCounter,
    /// Whether counts are valid: false without `-icount shift=10`.
    exact: bool,
    config: Config,
    machine: Machine,
    stages: Stages,
    /// Ticks since the last reset.
    ticks: u64,
    /// Largest measured stack use of a tick, bytes.
    deepest: usize,
}

impl Steps {
    /// At power-up, with the spec's settings.
    pub const fn new(counter: InstructionCounter, exact: bool) -> Self {
        Self {
            counter,
            exact,
            config: Config::new(),
            machine: machine_at_reset(),
            stages: Stages::new(),
            ticks: 0,
            deepest: 0,
        }
    }
}

impl lockstep::Machine for Steps {
    fn description(&self) -> &str {
        DESCRIPTION
    }

    fn words(&self) -> [usize; 3] {
        [CONFIG_WORDS, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS]
    }

    fn stages(&self) -> usize {
        self.stages.all().len()
    }

    fn counted(&self) -> CostUnit {
        if self.exact { CostUnit::Instructions } else { CostUnit::Nothing }
    }

    fn configure(&mut self, config: &[u64]) -> Result<(), usize> {
        let words = config.first_chunk().ok_or(CONFIG_WORDS)?;
        self.config = Config::from_words(words).map_err(|error| error.word)?;
        Ok(())
    }

    fn reset(&mut self) {
        self.machine = machine_at_reset();
        self.ticks = 0;
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32) {
        // The link checks the lengths.
        let row = input.first_chunk().unwrap_or(&[0; MACHINE_INPUT_WORDS]);
        let input = MachineInput::from_words(row);
        let due = is_due(self.ticks);
        if due {
            self.stages.measure(&mut self.counter, &self.config, &self.machine.state, &input.tick);
        }
        let (result, instructions, depth) =
            counted_tick(&mut self.counter, &self.config, &mut self.machine, &input, due);
        self.stages.add_step(instructions);
        if depth > self.deepest {
            self.deepest = depth;
        }
        self.ticks += 1;
        for (slot, word) in output.iter_mut().zip(machine_output_words(&result, &self.machine)) {
            *slot = word;
        }
        (self.machine.digest(), instructions)
    }

    fn stage(&self, index: usize) -> Option<Stage<'_>> {
        let stage = self.stages.all().get(index)?;
        let (name, stack) = if index == 0 { (WHOLE, self.deepest as u32) } else { (stage.name(), 0) };
        let [calls, smallest, sum, largest] = stage.counts();
        Some(Stage { name, calls, smallest, sum, largest, stack: if stack > 0 { Some(stack) } else { None } })
    }
}

/// Whether stages and stack are measured on this tick. That takes far longer than the tick.
const fn is_due(tick: u64) -> bool {
    tick % 32 == 0
}
