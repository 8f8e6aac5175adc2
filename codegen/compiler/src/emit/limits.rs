//! `src/limits.rs`: the converter. Reads [`ir::Actuation`](crate::ir::Actuation); exports `DAC` and the code limits.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let a = &ir.actuation;
    let dac = literal::constant!(ir.scalar, dac, a);
    let (code_min, code_max) = (literal::integer(a.code_min), literal::integer(a.code_max));
    let dac_bits = literal::integer(a.bits.cast_signed());
    let codes_doc = format!(
        " Lowest and highest code whose voltage lies within {} V … {} V; from `actuator.voltage` and `dac`.",
        a.voltage[0], a.voltage[1]
    );
    quote! {
        #![doc = " Limits of the output codes."]

        use specgen_runtime::Dac;

        use crate::Real;

        /// Converter codes in volts and in cells of the Everett grid; from `dac` and `actuator.voltage`.
        pub const DAC: Dac<Real> = #dac;
        /// Bits of a code; from `dac.bits`.
        pub const DAC_BITS: u32 = #dac_bits;
        #[doc = #codes_doc]
        pub const CODES: [i32; 2] = [#code_min, #code_max];
    }
}
