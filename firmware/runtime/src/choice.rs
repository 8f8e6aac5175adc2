//! Enumerations that are one word of a state, a link or a record.

/// An enumeration that is one word.
pub trait Choice: Sized {
    /// Its word.
    fn to_word(&self) -> u64;
    /// The inverse; none for an unknown word.
    fn of_word(word: u64) -> Option<Self>;
}

/// Declares an enumeration in one list: each variant with its word and, for all or for none, its name. `or` names the
/// variant for unknown words; without it, unknown words are refused.
macro_rules! choice {
    (
        $(#[$about:meta])*
        $visible:vis enum $name:ident $(or $other:ident)? {
            $($(#[$of_variant:meta])* $variant:ident = $word:literal $(=> $text:literal)?,)+
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        $visible enum $name {
            $($(#[$of_variant])* $variant = $word,)+
        }

        impl $name {
            /// Its word.
            #[inline]
            #[must_use]
            pub const fn word(self) -> u64 {
                self as u64
            }

            $crate::choice::choice!(@name $($variant $($text)?)+);
        }

        $crate::choice::choice!(@words $name $($other)?; $($word $variant)+);
    };
    (@name $($variant:ident)+) => {};
    (@name $($variant:ident $text:literal)+) => {
        /// Name for messages.
        #[must_use]
        pub const fn name(self) -> &'static str {
            match self {
                $(Self::$variant => $text,)+
            }
        }
    };
    (@words $name:ident; $($word:literal $variant:ident)+) => {
        impl $name {
            /// The inverse of `word`; none for any other number.
            #[must_use]
            pub const fn from_word(word: u64) -> Option<Self> {
                match word {
                    $($word => Some(Self::$variant),)+
                    _ => None,
                }
            }
        }

        impl $crate::choice::Choice for $name {
            fn to_word(&self) -> u64 {
                self.word()
            }

            fn of_word(word: u64) -> Option<Self> {
                Self::from_word(word)
            }
        }
    };
    (@words $name:ident $other:ident; $($word:literal $variant:ident)+) => {
        impl $name {
            #[doc = concat!("The inverse of `word`; `", stringify!($other), "` for any other number.")]
            #[inline]
            #[must_use]
            pub const fn from_word(word: u64) -> Self {
                match word {
                    $($word => Self::$variant,)+
                    _ => Self::$other,
                }
            }
        }

        impl $crate::choice::Choice for $name {
            fn to_word(&self) -> u64 {
                self.word()
            }

            fn of_word(word: u64) -> Option<Self> {
                Some(Self::from_word(word)).filter(|choice| choice.word() == word)
            }
        }
    };
}
pub(crate) use choice;

/// None is all ones.
impl Choice for Option<u32> {
    fn to_word(&self) -> u64 {
        self.map_or(u64::MAX, u64::from)
    }

    fn of_word(word: u64) -> Option<Self> {
        match word {
            u64::MAX => Some(None),
            word if word <= u64::from(u32::MAX) => Some(Some(word as u32)),
            _ => None,
        }
    }
}
