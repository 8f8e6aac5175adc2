//! `src/sensing.rs` of six legs: what the codes of the gauges' converters mean.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::gauge_converter;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let converter = gauge_converter::emit(ir);
    quote! {
        #![doc = " Readings of the legs' own gauges."]

        use specgen_runtime::GaugeConverter;

        use crate::Real;

        #converter
    }
}
