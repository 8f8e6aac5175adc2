//! `src/words.rs` of a platform: inputs, outputs and config as named 64-bit words, for traces and links. The same for every
//! spec.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{description, literal};
use crate::ir::{Ir, TaskSpace};

/// Vectors of the input that a command brings, and those that are measured.
const COMMAND_VECTORS: [&str; 3] = ["setpoint", "setpoint_rate", "setpoint_acceleration"];
const MEASURED_VECTORS: [&str; 2] = ["gauge", "wrench"];
const OUTPUT_VECTORS: [&str; 9] =
    ["voltage", "requested", "demand", "level", "drift", "dac_code", "pose", "target", "load"];

/// Names of the input words.
pub fn inputs() -> Vec<String> {
    let mut inputs: Vec<String> = ["command", "selector", "sequence"].map(str::to_owned).to_vec();
    inputs.extend(description::vectors(&COMMAND_VECTORS));
    inputs.extend(description::vectors(&MEASURED_VECTORS));
    inputs
}

/// Names of the output words.
pub fn outputs() -> Vec<String> {
    let mut outputs = description::vectors(&OUTPUT_VECTORS);
    outputs.push("status".to_owned());
    outputs
}

pub fn emit(ir: &Ir, task: &TaskSpace) -> TokenStream {
    let (inputs, outputs) = (inputs(), outputs());
    let config = ir.permitted.names();
    let at = |first: &str| literal::count(config.iter().take_while(|name| *name != first).count());
    let (weights_at, codes_at, gains_at) = (at("level_weight"), at("max_step_codes"), at("kp[0]"));
    let bias: Vec<String> = task.law.bias.iter().map(|value| format!("{value:?}")).collect();
    let description =
        description::text(ir, "platform", &inputs, &outputs, &config) + &format!("bias={}\n", bias.join(","));
    let (input_words, output_words, config_words) =
        (literal::count(inputs.len()), literal::count(outputs.len()), literal::count(config.len()));
    quote! {
        #![doc = " Inputs, outputs and settings as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target"]
        #![doc = " reads and writes these, so that two of them can be compared bit for bit."]

        use specgen_runtime::linear::{each, transform};
        use specgen_runtime::setpoint::{Command, CommandKind, Target};
        use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Real as _};

        use crate::config::{Environment, damps};
        use crate::task_space::MODES_TO_LEGS;
        use crate::{Config, ConfigError, LEGS, Real, State, TickInput, TickOutput};

        /// Words of a tick's input.
        pub const INPUT_WORDS: usize = #input_words;
        /// Words of a tick's output.
        pub const OUTPUT_WORDS: usize = #output_words;
        /// Words of the settings.
        pub const CONFIG_WORDS: usize = #config_words;
        /// Names of the input words. `command` is 0 hold, 1 stream, 2 move, 3 trajectory.
        pub const INPUT_NAMES: [&str; INPUT_WORDS] = [#(#inputs),*];
        /// Names of the output words.
        pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] = [#(#outputs),*];
        /// Names of the settings. `mode` is 0 P; 1, 2, 3 F with Invhys, EWMA, PCC; 4, 5, 6 P/F with the same. `interaction` is 0
        /// neglected, 1 modelled, 2 measured. `kp`, `ki`, `kv` are the gains of P/F, `position_…` those of P.
        pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = [#(#config),*];
        /// First word of the weights, of the code limits and of the gains in [`CONFIG_NAMES`].
        pub(crate) const CONFIG_WEIGHTS: usize = #weights_at;
        pub(crate) const CONFIG_CODES: usize = #codes_at;
        pub(crate) const CONFIG_GAINS: usize = #gains_at;
        /// First measured word in [`INPUT_NAMES`].
        const INPUT_MEASURED: usize = 21;

        /// What this controller is, one `key=value` a line, lists separated by commas: for tools that load it at run time.
        pub const DESCRIPTION: &str = #description;

        impl TickInput {
            /// From words in the order of [`INPUT_NAMES`].
            #[must_use]
            pub fn from_words(words: &[u64; INPUT_WORDS]) -> Self {
                Self {
                    command: Command {
                        kind: CommandKind::from_word(words[0]),
                        selector: saturated(words[1]),
                        sequence: saturated(words[2]),
                        target: Target { pose: six(words, 3), rate: six(words, 9), acceleration: six(words, 15) },
                    },
                    gauge: six(words, INPUT_MEASURED),
                    wrench: six(words, INPUT_MEASURED + 6),
                }
            }
        }

        /// Words in the order of [`OUTPUT_NAMES`], of a tick and of the state that it left. `level` and `drift` are δ̂ and φ̂ as
        /// displacements of the legs.
        #[must_use]
        pub fn output_words(output: &TickOutput, state: &State) -> [u64; OUTPUT_WORDS] {
            let mut words = [0; OUTPUT_WORDS];
            let target = state.generator.target();
            let level = transform(&MODES_TO_LEGS, &each(|mode| state.estimates[mode].level));
            let drift = transform(&MODES_TO_LEGS, &each(|mode| state.estimates[mode].drift));
            for (index, leg) in state.legs.iter().enumerate() {
                words[index] = output.voltage[index].to_word();
                words[LEGS + index] = leg.requested.to_word();
                words[2 * LEGS + index] = state.demand[index].to_word();
                words[3 * LEGS + index] = level[index].to_word();
                words[4 * LEGS + index] = drift[index].to_word();
                words[5 * LEGS + index] = output.dac_code[index] as u32 as u64;
                words[6 * LEGS + index] = state.pose[index].to_word();
                words[7 * LEGS + index] = target.pose[index].to_word();
                words[8 * LEGS + index] = state.load[index].to_word();
            }
            words[9 * LEGS] = output.status as u64;
            words
        }

        impl Config {
            /// From words in the order of [`CONFIG_NAMES`].
            ///
            /// # Errors
            /// The first word that is out of range.
            pub fn from_words(words: &[u64; CONFIG_WORDS]) -> Result<Self, ConfigError> {
                Self::check(words)?;
                let Some(mode) = ControlMode::from_word(words[0]) else {
                    return Err(ConfigError { word: 0 });
                };
                let Some(interaction) = Interaction::from_word(words[1]) else {
                    return Err(ConfigError { word: 1 });
                };
                let set = |first: usize| Gains {
                    proportional: six(words, first),
                    integral: six(words, first + 6),
                    derivative: six(words, first + 12),
                };
                let (gains, position_gains) = (set(CONFIG_GAINS), set(CONFIG_GAINS + 18));
                // All of them in one piece: a copy for each would not fit the stack of a small part.
                Ok(Self {
                    mode,
                    interaction,
                    level_weight: Real::from_word(words[CONFIG_WEIGHTS]),
                    drift_weight: Real::from_word(words[CONFIG_WEIGHTS + 1]),
                    code_limits: CodeLimits {
                        max_step: words[CONFIG_CODES] as i32,
                        min: words[CONFIG_CODES + 1] as i32,
                        max: words[CONFIG_CODES + 2] as i32,
                    },
                    damps: [damps(&gains), damps(&position_gains)],
                    gains,
                    position_gains,
                    environment: Environment {
                        stiffness: six(words, CONFIG_GAINS + 36),
                        rest: six(words, CONFIG_GAINS + 42),
                    },
                })
            }

            /// Words in the order of [`CONFIG_NAMES`].
            #[must_use]
            pub fn to_words(&self) -> [u64; CONFIG_WORDS] {
                let mut words = [0; CONFIG_WORDS];
                let limits = self.code_limits();
                words[0] = self.mode().word();
                words[1] = self.interaction().word();
                words[CONFIG_WEIGHTS] = self.level_weight().to_word();
                words[CONFIG_WEIGHTS + 1] = self.drift_weight().to_word();
                words[CONFIG_CODES] = limits.max_step as u32 as u64;
                words[CONFIG_CODES + 1] = limits.min as u32 as u64;
                words[CONFIG_CODES + 2] = limits.max as u32 as u64;
                let (combined, position) = (self.gains(), self.position_gains());
                let vectors = [
                    &combined.proportional,
                    &combined.integral,
                    &combined.derivative,
                    &position.proportional,
                    &position.integral,
                    &position.derivative,
                    &self.environment().stiffness,
                    &self.environment().rest,
                ];
                for (slots, vector) in words[CONFIG_GAINS..].chunks_exact_mut(6).zip(vectors) {
                    for (slot, value) in slots.iter_mut().zip(vector) {
                        *slot = value.to_word();
                    }
                }
                words
            }
        }

        /// Six numbers from the word `first` on; zero beyond the end.
        fn six(words: &[u64], first: usize) -> [Real; 6] {
            let mut vector = [0.0; 6];
            for (value, word) in vector.iter_mut().zip(words.iter().skip(first)) {
                *value = Real::from_word(*word);
            }
            vector
        }

        /// A counter from its word.
        fn saturated(word: u64) -> u32 {
            if word > u32::MAX as u64 { u32::MAX } else { word as u32 }
        }
    }
}
