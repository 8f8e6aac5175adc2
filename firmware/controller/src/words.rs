// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Inputs, outputs and settings as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target
//! reads and writes these, so that two of them can be compared bit for bit.

use crate::config::{Environment, damps};
use crate::task_space::MODES_TO_LEGS;
use crate::{Config, ConfigError, LEGS, Real, State, TickInput, TickOutput};
use specgen_runtime::linear::{each, transform};
use specgen_runtime::setpoint::{Command, CommandKind, Target};
use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Real as _};

/// Words of a tick's input.
pub const INPUT_WORDS: usize = 33;

/// Words of a tick's output.
pub const OUTPUT_WORDS: usize = 55;

/// Words of the settings.
pub const CONFIG_WORDS: usize = 55;

/// Names of the input words. `command` is 0 hold, 1 stream, 2 move, 3 trajectory.
pub const INPUT_NAMES: [&str; INPUT_WORDS] = [
    "command",
    "selector",
    "sequence",
    "setpoint[0]",
    "setpoint[1]",
    "setpoint[2]",
    "setpoint[3]",
    "setpoint[4]",
    "setpoint[5]",
    "setpoint_rate[0]",
    "setpoint_rate[1]",
    "setpoint_rate[2]",
    "setpoint_rate[3]",
    "setpoint_rate[4]",
    "setpoint_rate[5]",
    "setpoint_acceleration[0]",
    "setpoint_acceleration[1]",
    "setpoint_acceleration[2]",
    "setpoint_acceleration[3]",
    "setpoint_acceleration[4]",
    "setpoint_acceleration[5]",
    "gauge[0]",
    "gauge[1]",
    "gauge[2]",
    "gauge[3]",
    "gauge[4]",
    "gauge[5]",
    "wrench[0]",
    "wrench[1]",
    "wrench[2]",
    "wrench[3]",
    "wrench[4]",
    "wrench[5]",
];

/// Names of the output words.
pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] = [
    "voltage[0]",
    "voltage[1]",
    "voltage[2]",
    "voltage[3]",
    "voltage[4]",
    "voltage[5]",
    "requested[0]",
    "requested[1]",
    "requested[2]",
    "requested[3]",
    "requested[4]",
    "requested[5]",
    "demand[0]",
    "demand[1]",
    "demand[2]",
    "demand[3]",
    "demand[4]",
    "demand[5]",
    "level[0]",
    "level[1]",
    "level[2]",
    "level[3]",
    "level[4]",
    "level[5]",
    "drift[0]",
    "drift[1]",
    "drift[2]",
    "drift[3]",
    "drift[4]",
    "drift[5]",
    "dac_code[0]",
    "dac_code[1]",
    "dac_code[2]",
    "dac_code[3]",
    "dac_code[4]",
    "dac_code[5]",
    "pose[0]",
    "pose[1]",
    "pose[2]",
    "pose[3]",
    "pose[4]",
    "pose[5]",
    "target[0]",
    "target[1]",
    "target[2]",
    "target[3]",
    "target[4]",
    "target[5]",
    "load[0]",
    "load[1]",
    "load[2]",
    "load[3]",
    "load[4]",
    "load[5]",
    "status",
];

/// Names of the settings. `mode` is 0 P; 1, 2, 3 F with Invhys, EWMA, PCC; 4, 5, 6 P/F with the same. `interaction` is 0
/// neglected, 1 modelled, 2 measured. `kp`, `ki`, `kv` are the gains of P/F, `position_…` those of P.
pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = [
    "mode",
    "interaction",
    "level_weight",
    "drift_weight",
    "max_step_codes",
    "code_min",
    "code_max",
    "kp[0]",
    "kp[1]",
    "kp[2]",
    "kp[3]",
    "kp[4]",
    "kp[5]",
    "ki[0]",
    "ki[1]",
    "ki[2]",
    "ki[3]",
    "ki[4]",
    "ki[5]",
    "kv[0]",
    "kv[1]",
    "kv[2]",
    "kv[3]",
    "kv[4]",
    "kv[5]",
    "position_kp[0]",
    "position_kp[1]",
    "position_kp[2]",
    "position_kp[3]",
    "position_kp[4]",
    "position_kp[5]",
    "position_ki[0]",
    "position_ki[1]",
    "position_ki[2]",
    "position_ki[3]",
    "position_ki[4]",
    "position_ki[5]",
    "position_kv[0]",
    "position_kv[1]",
    "position_kv[2]",
    "position_kv[3]",
    "position_kv[4]",
    "position_kv[5]",
    "environment_stiffness[0]",
    "environment_stiffness[1]",
    "environment_stiffness[2]",
    "environment_stiffness[3]",
    "environment_stiffness[4]",
    "environment_stiffness[5]",
    "environment_rest[0]",
    "environment_rest[1]",
    "environment_rest[2]",
    "environment_rest[3]",
    "environment_rest[4]",
    "environment_rest[5]",
];

/// First word of the weights, of the code limits and of the gains in [`CONFIG_NAMES`].
pub(crate) const CONFIG_WEIGHTS: usize = 2;
pub(crate) const CONFIG_CODES: usize = 4;
pub(crate) const CONFIG_GAINS: usize = 7;

/// First measured word in [`INPUT_NAMES`].
const INPUT_MEASURED: usize = 21;
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
            environment: Environment { stiffness: six(words, CONFIG_GAINS + 36), rest: six(words, CONFIG_GAINS + 42) },
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
