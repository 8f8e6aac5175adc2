// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Inputs, outputs and settings as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target
//! reads and writes these, so that two of them can be compared bit for bit.

use crate::config::{Environment, damps};
use crate::machine_words::six;
use crate::names::names;
use crate::task_space::MODES_TO_LEGS;
use crate::{Config, ConfigError, LEGS, Real, State, TickInput, TickOutput, permitted};
use specgen_runtime::linear::{each, transform};
use specgen_runtime::setpoint::{Command, CommandKind, Target};
use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Real as _};

/// Words of a tick's input.
pub const INPUT_WORDS: usize = 33;

/// Words of a command: they stand before those that are measured.
pub const COMMAND_WORDS: usize = 21;

/// Words of a tick's output.
pub const OUTPUT_WORDS: usize = 55;

/// Words of the settings.
pub const CONFIG_WORDS: usize = 55;

/// Names of the input words. `command` is 0 hold, 1 stream, 2 move, 3 trajectory.
pub const INPUT_NAMES: [&str; INPUT_WORDS] =
    names!["command", "selector", "sequence"; "setpoint", "setpoint_rate", "setpoint_acceleration", "gauge", "wrench";];

/// Names of the output words.
pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] =
    names![; "voltage", "requested", "demand", "level", "drift", "dac_code", "pose", "target", "load"; "status"];

/// Names of the settings. `mode` is 0 P; 1, 2, 3 F with Invhys, EWMA, PCC; 4, 5, 6 P/F with the same. `interaction` is 0
/// neglected, 1 modelled, 2 measured. `kp`, `ki`, `kv` are the gains of P/F, `position_…` those of P.
pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = permitted::NAMES;

/// First word of the weights, of the code limits and of the gains in [`CONFIG_NAMES`].
pub(crate) const CONFIG_WEIGHTS: usize = 2;
pub(crate) const CONFIG_CODES: usize = 4;
pub(crate) const CONFIG_GAINS: usize = 7;

impl TickInput {
    /// From words in the order of [`INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &[u64; INPUT_WORDS]) -> Self {
        let wrench = six(words, COMMAND_WORDS + 6);
        Self { command: command(words), gauge: six(words, COMMAND_WORDS), wrench }
    }

    /// Of the words of a command, and of readings as a target has them; it measures no wrench.
    #[must_use]
    pub fn measured(words: &[u64; COMMAND_WORDS], gauge: &[Real; 6]) -> Self {
        Self { command: command(words), gauge: *gauge, wrench: [Real::NAN; 6] }
    }
}

/// The command of a tick's first words.
fn command(words: &[u64]) -> Command<Real> {
    let [kind, selector, sequence] = *words.first_chunk().unwrap_or(&[0; 3]);
    Command {
        kind: CommandKind::from_word(kind),
        selector: saturated(selector),
        sequence: saturated(sequence),
        target: Target { pose: six(words, 3), rate: six(words, 9), acceleration: six(words, 15) },
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

/// A counter from its word.
fn saturated(word: u64) -> u32 {
    if word > u32::MAX as u64 { u32::MAX } else { word as u32 }
}
