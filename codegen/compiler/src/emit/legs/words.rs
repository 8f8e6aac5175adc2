//! `src/words.rs` of six legs: inputs, outputs and config as named 64-bit words, for traces and links. The same for every spec.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{description, literal};
use crate::ir::Ir;

/// Names of the input words.
pub fn inputs() -> Vec<String> {
    description::vectors(&["setpoint", "displacement"])
}

/// Names of the output words.
pub fn outputs() -> Vec<String> {
    let mut outputs = description::vectors(&["voltage", "requested", "demand", "level", "drift", "dac_code"]);
    outputs.push("status".to_owned());
    outputs
}

pub fn emit(ir: &Ir) -> TokenStream {
    let (inputs, outputs) = (inputs(), outputs());
    let config = ir.permitted.names();
    let codes_at = literal::count(config.iter().take_while(|name| *name != "max_step_codes").count());
    let description = description::text(ir, "legs", &inputs, &outputs, &config);
    let (input_words, output_words, config_words) =
        (literal::count(inputs.len()), literal::count(outputs.len()), literal::count(config.len()));
    quote! {
        #![doc = " Inputs, outputs and settings as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target"]
        #![doc = " reads and writes these, so that two of them can be compared bit for bit."]

        use specgen_runtime::{CodeLimits, Law, Real as _};

        use crate::{Config, ConfigError, LEGS, Real, SetpointKind, State, TickInput, TickOutput};

        /// Words of a tick's input.
        pub const INPUT_WORDS: usize = #input_words;
        /// Words of a tick's output.
        pub const OUTPUT_WORDS: usize = #output_words;
        /// Words of the settings.
        pub const CONFIG_WORDS: usize = #config_words;
        /// Names of the input words.
        pub const INPUT_NAMES: [&str; INPUT_WORDS] = [#(#inputs),*];
        /// Names of the output words.
        pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] = [#(#outputs),*];
        /// Names of the settings. `mode` is 0 invhys, 1 ewma, 2 pcc; `setpoint_kind` is 0 pose, 1 leg.
        pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = [#(#config),*];
        /// First word of the code limits in [`CONFIG_NAMES`].
        pub(crate) const CONFIG_CODES: usize = #codes_at;

        /// What this controller is, one `key=value` a line, lists separated by commas: for tools that load it at run time.
        pub const DESCRIPTION: &str = #description;

        impl TickInput {
            /// From words in the order of [`INPUT_NAMES`].
            #[must_use]
            pub fn from_words(words: &[u64; INPUT_WORDS]) -> Self {
                let mut input = Self { setpoint: [0.0; LEGS], displacement: [0.0; LEGS] };
                for index in 0..LEGS {
                    input.setpoint[index] = Real::from_word(words[index]);
                    input.displacement[index] = Real::from_word(words[LEGS + index]);
                }
                input
            }
        }

        /// Words in the order of [`OUTPUT_NAMES`], of a tick; nothing of the state is needed.
        #[must_use]
        pub fn output_words(output: &TickOutput, _state: &State) -> [u64; OUTPUT_WORDS] {
            let mut words = [0; OUTPUT_WORDS];
            for index in 0..LEGS {
                words[index] = output.voltage[index].to_word();
                words[LEGS + index] = output.requested[index].to_word();
                words[2 * LEGS + index] = output.demand[index].to_word();
                words[3 * LEGS + index] = output.level[index].to_word();
                words[4 * LEGS + index] = output.drift[index].to_word();
                words[5 * LEGS + index] = output.dac_code[index] as u32 as u64;
            }
            words[6 * LEGS] = output.status as u64;
            words
        }

        impl Config {
            /// From words in the order of [`CONFIG_NAMES`].
            ///
            /// # Errors
            /// The first word that is out of range.
            pub fn from_words(words: &[u64; CONFIG_WORDS]) -> Result<Self, ConfigError> {
                Self::check(words)?;
                let law = match words[0] {
                    0 => Law::Invhys,
                    1 => Law::Ewma,
                    2 => Law::Pcc,
                    _ => return Err(ConfigError { word: 0 }),
                };
                let setpoint = match words[1] {
                    0 => SetpointKind::Pose,
                    1 => SetpointKind::Leg,
                    _ => return Err(ConfigError { word: 1 }),
                };
                let limits = CodeLimits {
                    max_step: words[CONFIG_CODES] as i32,
                    min: words[CONFIG_CODES + 1] as i32,
                    max: words[CONFIG_CODES + 2] as i32,
                };
                Self::new()
                    .with_law(law)
                    .with_setpoint(setpoint)
                    .with_weights(Real::from_word(words[2]), Real::from_word(words[3]))?
                    .with_run_interval(words[4] as u32)?
                    .with_code_limits(limits)
            }

            /// Words in the order of [`CONFIG_NAMES`].
            #[must_use]
            pub fn to_words(&self) -> [u64; CONFIG_WORDS] {
                let law = match self.law() {
                    Law::Invhys => 0,
                    Law::Ewma => 1,
                    Law::Pcc => 2,
                };
                let setpoint = match self.setpoint() {
                    SetpointKind::Pose => 0,
                    SetpointKind::Leg => 1,
                };
                let limits = self.code_limits();
                [
                    law,
                    setpoint,
                    self.level_weight().to_word(),
                    self.drift_weight().to_word(),
                    self.run_interval() as u64,
                    limits.max_step as u32 as u64,
                    limits.min as u32 as u64,
                    limits.max as u32 as u64,
                ]
            }
        }
    }
}
