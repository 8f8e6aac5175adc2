// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Inputs and outputs of the supervised tick as 64-bit words: those of the control law, and what the supervisor adds.

use crate::supervised::{Machine, MachineInput, MachineOutput, Request};
use crate::words::{INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, output_words};
use crate::{COMMAND_WORDS, Real, TickInput};
use specgen_runtime::Real as _;

/// Words of a supervised tick's input.
pub const MACHINE_INPUT_WORDS: usize = INPUT_WORDS + 2;

/// Words of a supervised tick's output.
pub const MACHINE_OUTPUT_WORDS: usize = OUTPUT_WORDS + 2;

/// Names of the input words. `request` is 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge; `events` holds bits.
pub const MACHINE_INPUT_NAMES: [&str; MACHINE_INPUT_WORDS] = followed(&INPUT_NAMES, ["request", "events"]);

/// Names of the output words. `supervisor` is phase | cause << 8 | amplifier on << 16; `conditions` has bit 1 << cause
/// for each cause that is present, whether it has lasted or not, and from bit 16 on the gauges or legs concerned.
pub const MACHINE_OUTPUT_NAMES: [&str; MACHINE_OUTPUT_WORDS] = followed(&OUTPUT_NAMES, ["supervisor", "conditions"]);

/// The names of the law's words, and two more.
const fn followed<const N: usize, const ALL: usize>(
    law: &[&'static str; N],
    more: [&'static str; 2],
) -> [&'static str; ALL] {
    let mut all = [more[1]; ALL];
    let mut k = 0;
    while k < N {
        all[k] = law[k];
        k += 1;
    }
    all[N] = more[0];
    all
}

impl MachineInput {
    /// From words in the order of [`MACHINE_INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &[u64; MACHINE_INPUT_WORDS]) -> Self {
        // The law's words stand first, and are not copied: there always are so many.
        let tick = words.first_chunk().unwrap_or(&[0; INPUT_WORDS]);
        Self {
            tick: TickInput::from_words(tick),
            request: Request::from_word(words[INPUT_WORDS]),
            events: words[INPUT_WORDS + 1] as u32,
        }
    }

    /// Of what a target was asked for and what it measured, see [`TickInput::measured`].
    #[must_use]
    pub fn measured(command: &[u64; COMMAND_WORDS], gauge: &[Real; 6], request: Request, events: u32) -> Self {
        Self { tick: TickInput::measured(command, gauge), request, events }
    }
}

/// Words in the order of [`MACHINE_OUTPUT_NAMES`], of a tick and of the machine that it left.
#[must_use]
pub fn machine_output_words(output: &MachineOutput, machine: &Machine) -> [u64; MACHINE_OUTPUT_WORDS] {
    let mut words = [0; MACHINE_OUTPUT_WORDS];
    for (slot, word) in words.iter_mut().zip(output_words(&output.tick, &machine.state)) {
        *slot = word;
    }
    words[OUTPUT_WORDS] = output.phase.word() | output.cause.word() << 8 | (output.amplifier_on as u64) << 16;
    words[OUTPUT_WORDS + 1] = machine.supervisor.conditions as u64;
    words
}

/// Six numbers from the word `first` on; zero beyond the end.
pub(crate) fn six(words: &[u64], first: usize) -> [Real; 6] {
    let mut vector = [0.0; 6];
    for (value, word) in vector.iter_mut().zip(words.iter().skip(first)) {
        *value = Real::from_word(*word);
    }
    vector
}
