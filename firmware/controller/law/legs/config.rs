//! What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build.

use crate::defaults::{DRIFT_WEIGHT, LAW, LEVEL_WEIGHT, MAX_STEP, RUN_INTERVAL, SETPOINT};
use crate::{Real, limits, permitted};
use specgen_runtime::{CodeLimits, Law, Permitted, Real as _, SetpointKind};

/// Words of the settings.
pub const CONFIG_WORDS: usize = permitted::WORDS;

/// Names of the settings. `mode` is 0 invhys, 1 ewma, 2 pcc; `setpoint_kind` is 0 pose, 1 leg.
pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = permitted::NAMES;

/// First word of the code limits in [`CONFIG_NAMES`].
const CONFIG_CODES: usize = 5;

/// A value that a [`Config`] cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The word of [`CONFIG_NAMES`] that is out of range.
    pub word: usize,
}

/// Checked settings. Every value it holds keeps the tick within its promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    law: Law,
    setpoint: SetpointKind,
    level_weight: Real,
    drift_weight: Real,
    run_interval: u32,
    code_limits: CodeLimits,
}

impl Default for Config {
    fn default() -> Self {
        Self::new()
    }
}

impl Config {
    /// The spec's settings.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            law: LAW,
            setpoint: SETPOINT,
            level_weight: LEVEL_WEIGHT,
            drift_weight: DRIFT_WEIGHT,
            run_interval: RUN_INTERVAL,
            code_limits: CodeLimits { min: limits::CODES[0], max: limits::CODES[1], max_step: MAX_STEP },
        }
    }

    /// Adaptation law; from `adaptation.mode`.
    #[inline]
    #[must_use]
    pub const fn law(&self) -> Law {
        self.law
    }

    /// Meaning of the set-point; from `controller.setpoint`.
    #[inline]
    #[must_use]
    pub const fn setpoint(&self) -> SetpointKind {
        self.setpoint
    }

    /// ω (EWMA) or ω1 (PCC) per run, within [0, 1]; from `adaptation.level_weight`.
    #[inline]
    #[must_use]
    pub const fn level_weight(&self) -> Real {
        self.level_weight
    }

    /// ω2 (PCC) per run, within [0, 1]; from `adaptation.drift_weight`.
    #[inline]
    #[must_use]
    pub const fn drift_weight(&self) -> Real {
        self.drift_weight
    }

    /// Control ticks per run, at least one; from `adaptation.run_interval`.
    #[inline]
    #[must_use]
    pub const fn run_interval(&self) -> u32 {
        self.run_interval
    }

    /// Voltage limits and slew limit in converter codes.
    #[inline]
    #[must_use]
    pub const fn code_limits(&self) -> CodeLimits {
        self.code_limits
    }

    /// The same with another law.
    #[must_use]
    pub const fn with_law(self, law: Law) -> Self {
        Self { law, ..self }
    }

    /// The same with another meaning of the set-point.
    #[must_use]
    pub const fn with_setpoint(self, setpoint: SetpointKind) -> Self {
        Self { setpoint, ..self }
    }

    /// The same with other weights per run.
    ///
    /// # Errors
    /// A weight outside its range in [`permitted::SETTINGS`]. That they are stable on the platform is for the
    /// compiler to check, not for this function.
    pub fn with_weights(self, level_weight: Real, drift_weight: Real) -> Result<Self, ConfigError> {
        Self { level_weight, drift_weight, ..self }.checked()
    }

    /// The same with another run interval.
    ///
    /// # Errors
    /// An interval outside its range.
    pub fn with_run_interval(self, run_interval: u32) -> Result<Self, ConfigError> {
        Self { run_interval, ..self }.checked()
    }

    /// The same with other code limits.
    ///
    /// # Errors
    /// A step below one code or above `actuator.slew_rate`, or limits that leave the spec's voltage limits or are empty.
    pub fn with_code_limits(self, code_limits: CodeLimits) -> Result<Self, ConfigError> {
        Self { code_limits, ..self }.checked()
    }

    /// From words in the order of [`CONFIG_NAMES`].
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn from_words(words: &[u64; CONFIG_WORDS]) -> Result<Self, ConfigError> {
        Self::check(words)?;
        let Some(law) = Law::from_word(words[0]) else {
            return Err(ConfigError { word: 0 });
        };
        let Some(setpoint) = SetpointKind::from_word(words[1]) else {
            return Err(ConfigError { word: 1 });
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
        let CodeLimits { max_step, min, max } = self.code_limits;
        [
            self.law.word(),
            self.setpoint.word(),
            self.level_weight.to_word(),
            self.drift_weight.to_word(),
            self.run_interval as u64,
            max_step as u32 as u64,
            min as u32 as u64,
            max as u32 as u64,
        ]
    }

    /// These settings, if each is within its range.
    #[inline(never)]
    fn checked(self) -> Result<Self, ConfigError> {
        Self::check(&self.to_words())?;
        Ok(self)
    }

    /// Every word is within its range, or the first that is not.
    #[inline(never)]
    fn check(words: &[u64; CONFIG_WORDS]) -> Result<(), ConfigError> {
        for (word, value) in words.iter().enumerate() {
            match Permitted::of(&permitted::SETTINGS, word) {
                Some(permitted) if permitted.takes(*value) => {}
                _ => return Err(ConfigError { word }),
            }
        }
        if words[CONFIG_CODES + 2] < words[CONFIG_CODES + 1] {
            return Err(ConfigError { word: CONFIG_CODES + 2 });
        }
        Ok(())
    }
}
