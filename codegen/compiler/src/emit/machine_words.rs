//! `src/machine_words.rs`: inputs and outputs of the supervised tick as words.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;

/// Names of the words that the supervised tick has beyond those of the control law.
const INPUTS: [&str; 2] = ["request", "events"];
const OUTPUTS: [&str; 2] = ["supervisor", "conditions"];

/// `inputs` and `outputs` are the names of the control law's words.
pub fn emit(inputs: &[String], outputs: &[String]) -> TokenStream {
    let (input_names, output_names) = (INPUTS, OUTPUTS);
    let (more_inputs, more_outputs) = (literal::count(INPUTS.len()), literal::count(OUTPUTS.len()));
    quote! {
        #![doc = " Inputs and outputs of the supervised tick as 64-bit words: those of the control law, and what the supervisor adds."]

        use crate::supervised::{Machine, MachineInput, MachineOutput, Request};
        use crate::{INPUT_WORDS, OUTPUT_WORDS, TickInput, output_words};

        /// Words of a supervised tick's input.
        pub const MACHINE_INPUT_WORDS: usize = INPUT_WORDS + #more_inputs;
        /// Words of a supervised tick's output.
        pub const MACHINE_OUTPUT_WORDS: usize = OUTPUT_WORDS + #more_outputs;
        /// Names of the input words. `request` is 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge; `events` holds bits.
        pub const MACHINE_INPUT_NAMES: [&str; MACHINE_INPUT_WORDS] = [#(#inputs,)* #(#input_names),*];
        /// Names of the output words. `supervisor` is phase | cause << 8 | amplifier on << 16; `conditions` has bit 1 << cause
        /// for each cause that is present, whether it has lasted or not, and from bit 16 on the gauges or legs concerned.
        pub const MACHINE_OUTPUT_NAMES: [&str; MACHINE_OUTPUT_WORDS] = [#(#outputs,)* #(#output_names),*];

        impl MachineInput {
            /// From words in the order of [`MACHINE_INPUT_NAMES`].
            #[must_use]
            pub fn from_words(words: &[u64; MACHINE_INPUT_WORDS]) -> Self {
                // The law's words stand first, and nobody is to copy them: there always are so many.
                let tick = words.first_chunk().unwrap_or(&[0; INPUT_WORDS]);
                Self {
                    tick: TickInput::from_words(tick),
                    request: Request::from_word(words[INPUT_WORDS]),
                    events: words[INPUT_WORDS + 1] as u32,
                }
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
    }
}
