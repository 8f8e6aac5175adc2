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
        fn checked(self) -> Result<Self, ConfigError> {
            for (word, (value, permitted)) in self.to_words().into_iter().zip(&permitted::SETTINGS).enumerate() {
                if !permitted.takes(value) {
                    return Err(ConfigError { word });
                }
            }
            if self.code_limits.max < self.code_limits.min {
                return Err(ConfigError { word: CONFIG_CODES + 2 });
            }
            Ok(self)
        }
    }
}

/// What [`crate::ir::Permitted`] is asked for in `from_words`: that each word is within its range, before any becomes a value.
pub fn check_words() -> TokenStream {
    quote! {
        for (word, (value, permitted)) in words.iter().zip(&permitted::SETTINGS).enumerate() {
            if !permitted.takes(*value) {
                return Err(ConfigError { word });
            }
        }
    }
}
