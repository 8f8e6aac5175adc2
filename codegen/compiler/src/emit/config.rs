//! What the `Config` of both kinds of controller has alike: code limits, and the check against the table.

use proc_macro2::TokenStream;
use quote::quote;

/// Methods of `Config`.
pub fn code_limits() -> TokenStream {
    quote! {
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
                match permitted::of(word) {
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
}
