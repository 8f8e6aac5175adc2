//! `src/state.rs` of six legs: what the controller remembers. The same for every spec; sizes come from the other files.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::rest::{self, AtRest};
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let (lead_field, no_lead, digest_lead) = match &ir.hysteresis.lead {
        None => (quote! {}, quote! {}, quote! {}),
        Some(_) => (
            quote! {
                /// What the leg is asked for beyond the demand, so that it arrives in time, m.
                pub lead: Real,
            },
            quote! { lead: 0.0, },
            quote! { digest.real(leg.lead); },
        ),
    };
    let leg = |AtRest { memory, code, .. }: AtRest| {
        quote! { LegState { memory: #memory, estimate: Estimate::new(), code: #code, #no_lead } }
    };
    let reset = match rest::emit(ir) {
        Err(alike) => {
            let leg = leg(alike);
            quote! {
                let leg = #leg;
                Self { legs: [leg; LEGS], demand: [0.0; LEGS], ticks_in_run: 0 }
            }
        }
        Ok(each) => {
            let legs = each.map(leg);
            quote! { Self { legs: [#(#legs),*], demand: [0.0; LEGS], ticks_in_run: 0 } }
        }
    };
    let reset_doc = rest::doc(ir);
    let limits = ir.supervision.risen.is_none().then(|| quote! { , limits });
    quote! {
        #![doc = " What the controller remembers from tick to tick. No NaN or infinity is ever stored here."]

        use specgen_runtime::{Digest, Estimate};

        use crate::hysteresis::Memory;
        use crate::{LEGS, Real #limits};

        /// State of one leg.
        #[derive(Debug, Clone, Copy)]
        pub struct LegState {
            /// Reversal memory; its displacement is q̂ = ρ̂X, what was really requested, m.
            pub memory: Memory,
            /// δ̂ and φ̂, m.
            pub estimate: Estimate<Real>,
            /// Converter code now held at the output.
            pub code: i32,
            #lead_field
        }

        /// State of the controller.
        #[derive(Debug, Clone, Copy)]
        pub struct State {
            /// Legs 0 to 5.
            pub legs: [LegState; LEGS],
            /// T: leg displacements demanded by the last accepted set-point, m.
            pub demand: [Real; LEGS],
            /// Ticks since the last run ended.
            pub ticks_in_run: u32,
        }

        impl Default for State {
            fn default() -> Self {
                Self::new()
            }
        }

        impl State {
            #[doc = #reset_doc]
            #[must_use]
            pub const fn new() -> Self {
                #reset
            }

            /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
            #[must_use]
            pub fn digest(&self) -> u64 {
                let mut digest = Digest::new();
                for leg in &self.legs {
                    leg.memory.digest(&mut digest);
                    leg.estimate.digest(&mut digest);
                    digest.word(leg.code as u32 as u64);
                    #digest_lead
                }
                for demand in &self.demand {
                    digest.real(*demand);
                }
                digest.word(self.ticks_in_run as u64);
                digest.finish()
            }
        }
    }
}
