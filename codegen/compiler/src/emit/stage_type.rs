//! What a measurable stage is: the same for every controller.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;

pub fn emit(count: usize) -> TokenStream {
    let count = literal::count(count);
    quote! {
        /// Number of stages.
        pub const STAGE_COUNT: usize = #count;

        /// A part of the tick. `run` gets a copy of the state and leaves its result there.
        #[derive(Debug, Clone, Copy)]
        pub struct Stage {
            /// Name, at most 16 bytes of ASCII.
            pub name: &'static str,
            /// How often a tick runs it: once, or once for each leg with the number of the leg.
            pub calls: usize,
            /// The part itself.
            pub run: extern "C" fn(&Config, &mut State, &TickInput, usize),
        }
    }
}
