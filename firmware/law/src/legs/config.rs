//! What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build.

use specgen_runtime::snapshot::Writer;
use specgen_runtime::{CodeLimits, Law, Permitted, Real as _, SetpointKind};

use super::constants::SixLegs;
use crate::spec::{Compiled, ConfigError};
use crate::words::{WordArray as _, word};

/// First word of the code limits.
const CONFIG_CODES: usize = 5;

/// Settings, unchecked: the spec's as the compiler writes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<P: SixLegs> {
    /// From `adaptation.mode`.
    pub law: Law,
    /// From `controller.setpoint`.
    pub setpoint: SetpointKind,
    /// From `adaptation.level_weight`.
    pub level_weight: P::Real,
    /// From `adaptation.drift_weight`.
    pub drift_weight: P::Real,
    /// Ticks of a run; from `adaptation.run_interval`.
    pub run_interval: u32,
    /// From `actuator` and `dac`.
    pub code_limits: CodeLimits,
}

/// Checked settings. Every value it holds keeps the tick within its promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config<P: SixLegs>(Settings<P>);

impl<P: SixLegs + Compiled> Default for Config<P> {
    fn default() -> Self {
        Self::new()
    }
}

impl<P: SixLegs> Config<P> {
    /// Adaptation law; from `adaptation.mode`.
    #[inline]
    #[must_use]
    pub const fn law(&self) -> Law {
        self.0.law
    }

    /// Meaning of the set-point; from `controller.setpoint`.
    #[inline]
    #[must_use]
    pub const fn setpoint(&self) -> SetpointKind {
        self.0.setpoint
    }

    /// ω (EWMA) or ω1 (PCC) per run, within [0, 1]; from `adaptation.level_weight`.
    #[inline]
    #[must_use]
    pub const fn level_weight(&self) -> P::Real {
        self.0.level_weight
    }

    /// ω2 (PCC) per run, within [0, 1]; from `adaptation.drift_weight`.
    #[inline]
    #[must_use]
    pub const fn drift_weight(&self) -> P::Real {
        self.0.drift_weight
    }

    /// Control ticks per run, at least one; from `adaptation.run_interval`.
    #[inline]
    #[must_use]
    pub const fn run_interval(&self) -> u32 {
        self.0.run_interval
    }

    /// Voltage limits and slew limit in converter codes.
    #[inline]
    #[must_use]
    pub const fn code_limits(&self) -> CodeLimits {
        self.0.code_limits
    }

    /// From words in the order of the controller's `CONFIG_NAMES`.
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn read(p: P, words: &[u64]) -> Result<Self, ConfigError> {
        Self::check(p, words)?;
        let Some(law) = Law::from_word(word(words, 0)) else {
            return Err(ConfigError { word: 0 });
        };
        let Some(setpoint) = SetpointKind::from_word(word(words, 1)) else {
            return Err(ConfigError { word: 1 });
        };
        Ok(Self(Settings {
            law,
            setpoint,
            level_weight: P::Real::from_word(word(words, 2)),
            drift_weight: P::Real::from_word(word(words, 3)),
            run_interval: word(words, 4) as u32,
            code_limits: CodeLimits {
                max_step: word(words, CONFIG_CODES) as i32,
                min: word(words, CONFIG_CODES + 1) as i32,
                max: word(words, CONFIG_CODES + 2) as i32,
            },
        }))
    }

    /// Writes the words in the order of the controller's `CONFIG_NAMES`.
    pub fn save(&self, words: &mut Writer<'_>) {
        words.word(self.0.law.word());
        words.word(self.0.setpoint.word());
        words.real(self.0.level_weight);
        words.real(self.0.drift_weight);
        words.word(self.0.run_interval as u64);
        let CodeLimits { max_step, min, max } = self.0.code_limits;
        for code in [max_step, min, max] {
            words.word(code as u32 as u64);
        }
    }

    /// Every word is within its range, or the first that is not.
    #[inline(never)]
    fn check(p: P, words: &[u64]) -> Result<(), ConfigError> {
        for (word, value) in words.iter().enumerate() {
            match Permitted::of(p.permitted(), word) {
                Some(permitted) if permitted.takes(*value) => {}
                _ => return Err(ConfigError { word }),
            }
        }
        if word(words, CONFIG_CODES + 2) < word(words, CONFIG_CODES + 1) {
            return Err(ConfigError { word: CONFIG_CODES + 2 });
        }
        Ok(())
    }
}

impl<P: SixLegs + Compiled> Config<P> {
    /// The spec's settings.
    #[must_use]
    pub const fn new() -> Self {
        Self(P::DEFAULTS)
    }

    /// The same with another law.
    #[must_use]
    pub const fn with_law(self, law: Law) -> Self {
        Self(Settings { law, ..self.0 })
    }

    /// The same with another meaning of the set-point.
    #[must_use]
    pub const fn with_setpoint(self, setpoint: SetpointKind) -> Self {
        Self(Settings { setpoint, ..self.0 })
    }

    /// The same with other weights per run.
    ///
    /// # Errors
    /// A weight outside its range in the controller's `permitted::SETTINGS`. That they are stable on the platform is for the
    /// compiler to check, not for this function.
    pub fn with_weights(self, level_weight: P::Real, drift_weight: P::Real) -> Result<Self, ConfigError> {
        Self(Settings { level_weight, drift_weight, ..self.0 }).checked()
    }

    /// The same with another run interval.
    ///
    /// # Errors
    /// An interval outside its range.
    pub fn with_run_interval(self, run_interval: u32) -> Result<Self, ConfigError> {
        Self(Settings { run_interval, ..self.0 }).checked()
    }

    /// The same with other code limits.
    ///
    /// # Errors
    /// A step below one code or above `actuator.slew_rate`, or limits that leave the spec's voltage limits or are empty.
    pub fn with_code_limits(self, code_limits: CodeLimits) -> Result<Self, ConfigError> {
        Self(Settings { code_limits, ..self.0 }).checked()
    }

    /// From words in the order of the controller's `CONFIG_NAMES`.
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn from_words(words: &P::ConfigWords) -> Result<Self, ConfigError> {
        Self::read(P::CONSTANTS, words.as_ref())
    }

    /// Words in the order of the controller's `CONFIG_NAMES`.
    #[must_use]
    pub fn to_words(&self) -> P::ConfigWords {
        let mut all = P::ConfigWords::ZERO;
        self.save(&mut Writer::new(all.as_mut()));
        all
    }

    /// These settings, if each is within its range.
    #[inline(never)]
    fn checked(self) -> Result<Self, ConfigError> {
        Self::check(P::CONSTANTS, self.to_words().as_ref())?;
        Ok(self)
    }
}
