//! `src/checked.rs`: data for the controller's self-check: the settings at start-up as words, its origin, and the checksum of
//! both and of all tables. Reads [`ir::Integrity`](crate::ir::Integrity); the law's `integrity.rs` recomputes the checksum.

use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Ir, RateModel};

pub fn emit(ir: &Ir) -> TokenStream {
    let settings = ir.integrity.settings.iter().map(|word| hex(*word));
    let crc = hex(u64::from(ir.integrity.crc));
    let (identity, length) = (&ir.integrity.identity, literal::count(ir.integrity.identity.len()));
    let identity = Literal::byte_string(identity.as_bytes());
    let tables = tables(ir);
    let creep = match ir.hysteresis.rate {
        Some(RateModel::Creep { .. }) => Some(quote! { black_box(&hysteresis::CREEP_OF_LEGS).checksum(crc); }),
        Some(RateModel::BoucWen { ref plays, .. }) => {
            let plays = plays.as_ref().map(|_| {
                quote! {
                    for plays in black_box(&hysteresis::PLAYS_OF_LEGS) {
                        plays.checksum(crc);
                    }
                }
            });
            Some(quote! {
                for around in black_box(&hysteresis::AROUND_OF_LEGS) {
                    around.checksum(crc);
                }
                #plays
            })
        }
        _ => None,
    };
    let (setpoint, trajectories) = match ir.task_space {
        None => (None, None),
        Some(_) => (
            Some(quote! { , setpoint }),
            Some(quote! {
                for trajectory in black_box(&setpoint::TRAJECTORIES) {
                    trajectory.checksum(crc);
                }
            }),
        ),
    };
    quote! {
        #![doc = " Data for the controller's integrity check, see [`crate::integrity`]."]

        use core::hint::black_box;

        use specgen_runtime::Crc32;

        use crate::{CONFIG_WORDS, hysteresis #setpoint};

        /// CRC-32 (ISO-HDLC) of [`IDENTITY`], the tables, the trajectories and [`SETTINGS`]; computed by specgen.
        pub const CRC: u32 = #crc;

        /// The spec's settings, in the order of [`crate::CONFIG_NAMES`]: the value of `Config::new().to_words()`.
        pub static SETTINGS: [u64; CONFIG_WORDS] = [#(#settings),*];

        /// Origin of this controller, in one line, and its unmeasured values, in a second. It is part of every image
        /// whose target calls [`intact`](crate::integrity::intact). `specgen size` prints it; `specgen flash` asks about line 2.
        pub static IDENTITY: [u8; #length] = *#identity;

        /// Adds tables and trajectories.
        pub(crate) fn add_tables(crc: &mut Crc32) {
            #(crc.reals(black_box(&hysteresis::#tables));)*
            #creep
            #trajectories
        }
    }
}

/// A word in hexadecimal.
fn hex(word: u64) -> Literal {
    match format!("{word:#x}").parse() {
        Ok(literal) => literal,
        // Digits after 0x are a literal.
        Err(_) => unreachable!("{word:#x} is no literal"),
    }
}

/// Names of the tables of the hysteresis: those of the static model, then those of the rate.
fn tables(ir: &Ir) -> Vec<Ident> {
    let h = &ir.hysteresis;
    let of_rate = match &h.rate {
        Some(RateModel::DynamicPreisach { tables, .. }) => tables.len(),
        _ => 0,
    };
    let still = if h.has_plays() { 0 } else { h.tables.len() };
    let names = (0..still).map(|k| format_ident!("EVERETT_{k}"));
    names.chain((0..of_rate).map(|k| format_ident!("RATE_{k}"))).collect()
}
