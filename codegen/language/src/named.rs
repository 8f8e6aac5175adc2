//! Enumerations whose variants have names.

/// Declares an enumeration in one list: each variant with its name. `ALL` has them in this order, and `name` returns the name.
#[macro_export]
macro_rules! named {
    ($(#[$about:meta])* $visible:vis enum $name:ident { $($(#[$of_variant:meta])* $variant:ident => $text:literal,)+ }) => {
        $(#[$about])*
        $visible enum $name {
            $($(#[$of_variant])* $variant,)+
        }

        impl $name {
            /// Every variant, in the order of reports.
            pub const ALL: [Self; [$($text),+].len()] = [$(Self::$variant),+];

            /// Its name, for options and messages.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }
    };
}
