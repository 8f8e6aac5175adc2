//! Structs of constants. A compiler computes them in `f64` and holds them as they are; a controller has them in its scalar.

/// Declares a struct of constants, and a macro that calls another one with its name and its fields: what a compiler does with
/// each of them follows from this declaration.
macro_rules! constants {
    (($d:tt) $list:ident; $(#[$doc:meta])* pub struct $name:ident<T> { $($(#[$about:meta])* pub $field:ident: $of:ty,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name<T> {
            $($(#[$about])* pub $field: $of,)+
        }

        /// Calls a macro with the name of the struct and its fields.
        #[macro_export]
        macro_rules! $list {
            ($d with:ident) => {
                $d with! { $name: $($field)+ }
            };
        }
    };
}
pub(crate) use constants;
