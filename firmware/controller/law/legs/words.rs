//! Inputs, outputs and settings as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target
//! reads and writes these, so that two of them can be compared bit for bit.

use crate::machine_words::six;
use crate::names::names;
use crate::{Config, ConfigError, LEGS, Real, SetpointKind, State, TickInput, TickOutput, permitted};
use specgen_runtime::{CodeLimits, Law, Real as _};

/// Words of a tick's input.
pub const INPUT_WORDS: usize = 12;

/// Words of a command: they stand before those that are measured.
pub const COMMAND_WORDS: usize = 6;

/// Words of a tick's output.
pub const OUTPUT_WORDS: usize = 37;

/// Words of the settings.
pub const CONFIG_WORDS: usize = 8;

/// Names of the input words.
pub const INPUT_NAMES: [&str; INPUT_WORDS] = names![; "setpoint", "displacement";];

/// Names of the output words.
pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] =
    names![; "voltage", "requested", "demand", "level", "drift", "dac_code"; "status"];

/// Names of the settings. `mode` is 0 invhys, 1 ewma, 2 pcc; `setpoint_kind` is 0 pose, 1 leg.
pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = permitted::NAMES;

/// First word of the code limits in [`CONFIG_NAMES`].
pub(crate) const CONFIG_CODES: usize = 5;
impl TickInput {
    /// From words in the order of [`INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &[u64; INPUT_WORDS]) -> Self {
        Self { setpoint: six(words, 0), displacement: six(words, COMMAND_WORDS) }
    }

    /// Of the words of a command, and of readings as a target has them.
    #[must_use]
    pub fn measured(words: &[u64; COMMAND_WORDS], gauge: &[Real; 6]) -> Self {
        Self { setpoint: six(words, 0), displacement: *gauge }
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
