//! Replays supervised ticks: reads rows of MACHINE_INPUT_WORDS words, writes rows of MACHINE_OUTPUT_WORDS words and the digest of
//! the machine. On some running ticks the control law alone is also counted, on a copy of the state: the difference is the cost of
//! the supervisor.

use crate::counted::counted_tick;
use crate::instructions::{InstructionCounter, SelfTest};
use crate::semihosting::{Exit, File};
use crate::stats::{self, Stage};
use crate::{is_due, specgen_step, stack};
use controller::supervised::{
    MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Machine, MachineInput, Phase, machine_at_reset, machine_output_words,
};
use controller::{CONFIG_WORDS, Config, State, TickInput, TickOutput};

/// Ticks per file access.
const BATCH: usize = 64;

/// Stages of the statistics: running ticks, the law alone in these, all other ticks.
const RUNNING: usize = 0;
const LAW: usize = 1;
const OTHER: usize = 2;

/// The whole run.
#[inline(never)]
pub fn replay(
    counter: &mut InstructionCounter,
    self_test: SelfTest,
    config: &Config,
    input: &File,
) -> Result<(), Exit> {
    let output = File::create(b"output.bin\0").ok_or(Exit::CannotWrite)?;
    let mut machine = machine_at_reset();
    let mut stages = [Stage::new("supervise"), Stage::new("law"), Stage::new("other phases")];
    let mut rows = [[0; MACHINE_INPUT_WORDS]; BATCH];
    let mut results = [[0; MACHINE_OUTPUT_WORDS + 1]; BATCH];
    let mut ticks = 0;
    let mut deepest = 0;
    loop {
        let bytes = input.read(rows.as_flattened_mut());
        let count = bytes / size_of::<[u64; MACHINE_INPUT_WORDS]>();
        if count * size_of::<[u64; MACHINE_INPUT_WORDS]>() != bytes {
            return Err(Exit::InputSize);
        }
        if count == 0 {
            break;
        }
        for (row, result) in rows.iter().zip(&mut results).take(count) {
            let tick_input = MachineInput::from_words(row);
            let ran = machine.supervisor.phase == Phase::Running;
            let due = is_due(ticks);
            let law = (ran && due).then(|| count_law(counter, config, &machine.state, &tick_input.tick));
            let (tick_output, instructions, depth) = counted_tick(counter, config, &mut machine, &tick_input, due);
            match law {
                Some(law) if tick_output.phase == Phase::Running => {
                    stages[RUNNING].add(instructions);
                    stages[LAW].add(law);
                }
                _ if tick_output.phase != Phase::Running || !ran => stages[OTHER].add(instructions),
                _ => {}
            }
            if depth > deepest {
                deepest = depth;
            }
            let words = machine_output_words(&tick_output, &machine);
            for (slot, word) in result.iter_mut().zip(words) {
                *slot = word;
            }
            result[MACHINE_OUTPUT_WORDS] = machine.digest();
            ticks += 1;
        }
        if !output.write(results.get(..count).unwrap_or_default().as_flattened()) {
            return Err(Exit::CannotWrite);
        }
    }
    let sizes = [CONFIG_WORDS, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, size_of::<Machine>(), size_of::<Config>()];
    stats::finish(output, counter, self_test, ticks, sizes, [deepest, stack::WINDOW], &stages)
}

/// Instructions of the control law alone, on a copy of the state.
#[inline(never)]
#[allow(unsafe_code)] // The step is called from assembly that counts it.
fn count_law(counter: &mut InstructionCounter, config: &Config, state: &State, input: &TickInput) -> u32 {
    let mut copy = *state;
    let arguments = [(&raw const *config) as usize, (&raw mut copy) as usize, (&raw const *input) as usize];
    // SAFETY: a C function of these three references.
    unsafe { stack::measure::<TickOutput>(counter, specgen_step as *const (), arguments, false).1 }
}
