//! `src/snapshot.rs` of six legs: how their state, and what a tick reads, become words.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::snapshot;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let imports = quote! {
        use specgen_runtime::Estimate;
        use specgen_runtime::snapshot::LARGEST_PLACE;
    };
    let input = quote! {
        words.reals(&input.tick.setpoint);
        words.reals(&input.tick.displacement);
    };
    let (lead, save_lead, restore_lead) = match &ir.hysteresis.lead {
        None => (quote! {}, quote! {}, quote! {}),
        Some(_) => {
            (quote! { + 1 }, quote! { words.real(self.lead); }, quote! { self.lead = words.real(LARGEST_PLACE)?; })
        }
    };
    let leg = snapshot::Leg {
        words: quote! { <Memory as Snapshot>::WORDS + <Estimate<Real> as Snapshot>::WORDS + 1 #lead },
        save: quote! {
            self.estimate.save(words);
            #save_lead
        },
        restore: quote! {
            self.estimate.restore(words)?;
            #restore_lead
        },
    };
    let state = quote! {
        impl Snapshot for State {
            const WORDS: usize = LEGS * <LegState as Snapshot>::WORDS + LEGS + 1;

            fn save(&self, words: &mut Writer<'_>) {
                for leg in &self.legs {
                    leg.save(words);
                }
                words.reals(&self.demand);
                words.word(self.ticks_in_run as u64);
            }

            fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
                for leg in &mut self.legs {
                    leg.restore(words)?;
                }
                words.reals(&mut self.demand, LARGEST_PLACE)?;
                self.ticks_in_run = words.counter()?;
                Ok(())
            }
        }
    };
    snapshot::emit(&imports, &input, &leg, &state)
}
