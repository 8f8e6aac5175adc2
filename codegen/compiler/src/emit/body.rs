//! `src/body.rs`: constants of the inverse dynamics. Reads [`ir::Dynamics`](crate::ir::Dynamics); exports `PLATFORM` for the
//! law's `dynamics.rs`.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let d = &ir.dynamics;
    let platform = literal::constant!(ir.scalar, body, d);
    let pivots_doc = format!(
        " Over the declared workspace the smallest pivot of the elimination is {:.3} of the largest or more.",
        d.pivot_ratio
    );
    quote! {
        #![doc = " Constants of the platform and its legs for the inverse dynamics."]

        use specgen_runtime::Platform;
        use specgen_runtime::dynamics::Leg;

        use crate::Real;

        /// Constants of the platform; from `geometry`, `platform` and `leg`.
        ///
        #[doc = #pivots_doc]
        pub const PLATFORM: Platform<Real> = #platform;
    }
}
