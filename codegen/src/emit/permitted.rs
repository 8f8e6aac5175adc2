//! `src/permitted.rs`: the table of what settings may be. Reads [`ir::Permitted`](crate::ir::Permitted).

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::{Ir, Range, Scalar};

pub fn emit(ir: &Ir) -> TokenStream {
    let table = &ir.permitted;
    let rows = table.words().map(|(_, range)| match range {
        Range::Whole(least, most) => {
            let (least, most) = (literal::integer(least), literal::integer(most));
            quote! { Permitted::Whole(#least, #most) }
        }
        Range::Number(least, most) => {
            let (least, most) = (literal::real(ir.scalar, least), literal::real(ir.scalar, most));
            quote! { Permitted::Number(#least, #most) }
        }
    });
    let [request, reading, stiffness] =
        [table.state.request, table.state.reading, table.state.stiffness].map(|most| literal::real(Scalar::F64, most));
    quote! {
        #![doc = " What settings may be, and how large the numbers of a state may become: nothing beyond the limits of the spec."]

        use specgen_runtime::Permitted;
        use specgen_runtime::snapshot::Sizes;

        use crate::{CONFIG_WORDS, Real};

        /// Range of each word of [`crate::CONFIG_NAMES`], both ends included; `code_min` is at most `code_max`.
        pub const SETTINGS: [Permitted<Real>; CONFIG_WORDS] = [#(#rows),*];
        /// Largest numbers of a state, under any of these settings.
        pub const STATE: Sizes = Sizes { request: #request, reading: #reading, stiffness: #stiffness };
    }
}
