//! `src/permitted.rs`: the table of permitted settings. Reads [`ir::PermittedRanges`](crate::ir::PermittedRanges).

use std::marker::PhantomData;

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::constants;
use crate::ir::Ir;
use crate::ir::scalar::Rounding;

pub fn emit(ir: &Ir) -> TokenStream {
    let table = &ir.permitted;
    let settings = literal::constant!(ir.scalar, permitted, table);
    let count = literal::count(constants::permitted(&Rounding::<f64>(PhantomData), table).len());
    let names = table.names();
    let words = literal::count(table.words().count());
    let state = literal::printed(&constants::sizes(ir));
    quote! {
        #![doc = " Permitted ranges of settings, and largest numbers of a state: nothing beyond the limits of the spec."]

        use specgen_runtime::PermittedRange;
        use specgen_runtime::snapshot::Sizes;

        use crate::Real;

        /// Words of the settings.
        pub(crate) const WORDS: usize = #words;
        /// Their names.
        pub(crate) const NAMES: [&str; WORDS] = [#(#names),*];
        /// Ranges of the words, in the order of [`crate::CONFIG_NAMES`], ends included, with their numbers of words; `code_min` is at
        /// most `code_max`.
        pub const SETTINGS: [(PermittedRange<Real>, usize); #count] = #settings;
        /// Largest numbers of a state, under any of these settings.
        pub const STATE: Sizes = #state;
    }
}
