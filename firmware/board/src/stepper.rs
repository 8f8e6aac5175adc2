//! A board's machine stepped by a host, and the cost of a tick.

use controller::snapshot::digest;
use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, MachineInput, machine_output_words};
use controller::{CONFIG_WORDS, Config, DESCRIPTION};
use specgen_link::{CostUnit, Stage, lockstep};

use crate::exchange::{self, Access};
use crate::report::Stopwatch;

/// Name of the whole tick.
const WHOLE: &str = "supervise";

/// Cost of ticks since power-up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Costs {
    calls: u64,
    smallest: u64,
    sum: u64,
    largest: u64,
}

impl Costs {
    pub(crate) const NONE: Self = Self { calls: 0, smallest: u64::MAX, sum: 0, largest: 0 };

    fn add(&mut self, cost: u32) {
        let cost = u64::from(cost);
        self.calls += 1;
        self.sum += cost;
        if cost < self.smallest {
            self.smallest = cost;
        }
        if cost > self.largest {
            self.largest = cost;
        }
    }

    /// As a message of the link.
    pub(crate) fn stage(&self) -> Stage<'static> {
        let Self { calls, smallest, sum, largest } = *self;
        // Measured only from outside: the stack is not painted on a board.
        Stage { name: WHOLE, calls, smallest: if calls > 0 { smallest } else { 0 }, sum, largest, stack: None }
    }
}

/// Steps the machine while the tick is held off; in a lock-step the tick only keeps the converters at rest.
pub(crate) struct Stepper<'d, 'a> {
    pub(crate) stopwatch: Stopwatch,
    pub(crate) costs: &'d mut Costs,
    pub(crate) with: &'d mut Access<'a>,
}

impl lockstep::Machine for Stepper<'_, '_> {
    fn description(&self) -> &str {
        DESCRIPTION
    }

    fn words(&self) -> [usize; 3] {
        [CONFIG_WORDS, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS]
    }

    fn stages(&self) -> usize {
        usize::from(self.stopwatch.counted != CostUnit::Nothing)
    }

    fn counted(&self) -> CostUnit {
        self.stopwatch.counted
    }

    fn configure(&mut self, config: &[u64]) -> Result<(), usize> {
        let words = config.first_chunk().ok_or(CONFIG_WORDS)?;
        let config = Config::from_words(words).map_err(|error| error.word)?;
        (self.with)(&mut |exchange, _| exchange.configure(config));
        Ok(())
    }

    fn reset(&mut self) {
        (self.with)(&mut |_, machine| exchange::reset(machine));
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32) {
        // The link has checked the lengths.
        let row = input.first_chunk().unwrap_or(&[0; MACHINE_INPUT_WORDS]);
        let input = MachineInput::from_words(row);
        let mut done = (0, 0);
        let stopwatch = self.stopwatch;
        (self.with)(&mut |exchange, machine| {
            let begin = (stopwatch.now)();
            let result = exchange::step(&exchange.config, machine, &input);
            let cost = (stopwatch.now)().wrapping_sub(begin);
            for (slot, word) in output.iter_mut().zip(machine_output_words(&result, machine)) {
                *slot = word;
            }
            done = (digest(machine), cost);
        });
        self.costs.add(done.1);
        done
    }

    fn stage(&self, index: usize) -> Option<Stage<'_>> {
        (index < self.stages()).then(|| self.costs.stage())
    }
}
