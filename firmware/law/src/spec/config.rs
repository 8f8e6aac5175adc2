//! Settings that were checked. Their defaults are the spec's; another tuning is another `Config`, never another build.

use core::ops::Deref;

use specgen_runtime::PermittedRange;
use specgen_runtime::snapshot::Writer;

use super::{ConstSpec, Settings as _, SettingsOf, Spec};
use crate::words::{WordArray as _, word};

/// What may change while running. Every value it holds keeps the tick within its promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config<P: Spec>(SettingsOf<P>);

/// A value that a `Config` cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The word that is out of range, of those named by the controller's `CONFIG_NAMES`.
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

    /// The same after a change. While running a change of the mode is bumpless; of output lines each whose settings are other than before
    /// begins anew, low.
    ///
    /// # Errors
    /// The first word that is out of its range in the controller's `permitted::SETTINGS`. That gains and weights are stable on the platform
    /// is for the compiler to check, not for this function.
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
