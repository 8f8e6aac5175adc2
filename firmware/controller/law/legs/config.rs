//! What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build.

use crate::defaults::{DRIFT_WEIGHT, LAW, LEVEL_WEIGHT, MAX_STEP, RUN_INTERVAL, SETPOINT};
use crate::words::{CONFIG_CODES, CONFIG_WORDS};
use crate::{Real, limits, permitted};
use specgen_runtime::{CodeLimits, Law, Permitted};

/// What the six set-point numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetpointKind {
    /// Pose from rest: m, rad.
    Pose,
    /// Leg displacements, m.
    Leg,
}

/// A value that a [`Config`] cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The word of [`crate::CONFIG_NAMES`] that is out of range.
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

    /// These settings, if each is within its range.
    #[inline(never)]
    fn checked(self) -> Result<Self, ConfigError> {
        Self::check(&self.to_words())?;
        Ok(self)
    }

    /// Every word is within its range, or the first that is not.
    #[inline(never)]
    pub(crate) fn check(words: &[u64; CONFIG_WORDS]) -> Result<(), ConfigError> {
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
