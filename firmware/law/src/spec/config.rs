//! Checked settings. The defaults are the spec's. New tuning needs another `Config`, never another build.

use core::ops::Deref;

use specgen_runtime::PermittedRange;
use specgen_runtime::snapshot::Writer;

use super::{ConstSpec, Settings as _, SettingsOf, Spec};
use crate::words::{WordArray as _, word};

/// Settings, which may change while running. Every value it can hold keeps the tick's guarantees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config<P: Spec>(SettingsOf<P>);

/// An invalid word of settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// Index of the word that is out of range; the controller's `CONFIG_NAMES` names it.
    pub word: usize,
}

impl<P: Spec> Deref for Config<P> {
    type Target = SettingsOf<P>;

    #[inline(always)]
    fn deref(&self) -> &SettingsOf<P> {
        &self.0
    }
}

impl<P: Spec> Config<P> {
    /// From words in the order of the controller's `CONFIG_NAMES`.
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn read(p: P, words: &[u64]) -> Result<Self, ConfigError> {
        for (word, value) in words.iter().enumerate() {
            match PermittedRange::of(p.permitted(), word) {
                Some(permitted) if permitted.takes(*value) => {}
                _ => return Err(ConfigError { word }),
            }
        }
        let highest = SettingsOf::<P>::CODES + 2;
        if word(words, highest) < word(words, highest - 1) {
            return Err(ConfigError { word: highest });
        }
        Ok(Self(SettingsOf::<P>::read(p, words)?))
    }
}

impl<P: ConstSpec> Config<P> {
    /// The spec's settings.
    #[must_use]
    pub const fn new() -> Self {
        Self(P::DEFAULTS)
    }

    /// A changed copy. While running, a change of mode is bumpless. An output line whose settings change restarts,
    /// low.
    ///
    /// # Errors
    /// The first word that is out of its range in the controller's `permitted::SETTINGS`. The compiler, not this
    /// function, checks that gains and weights are stable on the platform.
    pub fn with(self, change: impl FnOnce(&mut SettingsOf<P>)) -> Result<Self, ConfigError> {
        let mut changed = self;
        change(&mut changed.0);
        Self::from_words(&changed.to_words())
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
}

impl<P: ConstSpec> Default for Config<P> {
    fn default() -> Self {
        Self::new()
    }
}
