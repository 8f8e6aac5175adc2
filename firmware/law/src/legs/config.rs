//! The settings of six legs.

use specgen_runtime::snapshot::Writer;
use specgen_runtime::{CodeLimits, Law, Real as _, SetpointKind};

use super::constants::SixLegs;
use crate::spec::{self, ConfigError};
use crate::words::{code_limits, save_code_limits, word};

/// Settings, unchecked: the spec's as the compiler writes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<P: SixLegs> {
    /// Adaptation law; from `adaptation.mode`.
    pub law: Law,
    /// Meaning of the set-point; from `controller.setpoint`.
    pub setpoint: SetpointKind,
    /// ω (EWMA) or ω1 (PCC) per run, within [0, 1]; from `adaptation.level_weight`.
    pub level_weight: P::Real,
    /// ω2 (PCC) per run, within [0, 1]; from `adaptation.drift_weight`.
    pub drift_weight: P::Real,
    /// Control ticks per run, at least one; from `adaptation.run_interval`.
    pub run_interval: u32,
    /// Voltage limits and slew limit in converter codes; from `actuator` and `dac`.
    pub code_limits: CodeLimits,
}

impl<P: SixLegs> spec::Settings<P> for Settings<P> {
    const CODES: usize = 5;

    #[inline(always)]
    fn code_limits(&self) -> CodeLimits {
        self.code_limits
    }

    fn read(_p: P, words: &[u64]) -> Result<Self, ConfigError> {
        Ok(Self {
            law: Law::from_word(word(words, 0)).ok_or(ConfigError { word: 0 })?,
            setpoint: SetpointKind::from_word(word(words, 1)).ok_or(ConfigError { word: 1 })?,
            level_weight: P::Real::from_word(word(words, 2)),
            drift_weight: P::Real::from_word(word(words, 3)),
            run_interval: word(words, 4) as u32,
            code_limits: code_limits(words, Self::CODES),
        })
    }

    fn save(&self, words: &mut Writer<'_>) {
        words.word(self.law.word());
        words.word(self.setpoint.word());
        words.real(self.level_weight);
        words.real(self.drift_weight);
        words.word(self.run_interval as u64);
        save_code_limits(&self.code_limits, words);
    }
}
