//! What a leg remembers at reset, which is at rest. Reads [`ir::Rest`](crate::ir::Rest).

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::{Ir, RateModel};

/// How a leg stands at reset.
pub struct AtRest {
    /// Reversal memory.
    pub memory: TokenStream,
    /// Displacement that the model gives, m.
    pub displacement: TokenStream,
    /// Converter code.
    pub code: TokenStream,
}

/// Of each leg; one for all where they rest at the lowest voltage, at which every history is forgotten.
pub fn emit(ir: &Ir) -> Result<[AtRest; 6], AtRest> {
    let Some(rest) = &ir.supervision.risen else {
        return Err(AtRest {
            memory: quote! { Memory::new() },
            displacement: quote! { 0.0 },
            code: quote! { limits::CODES[0] },
        });
    };
    let real = |value| literal::real(ir.scalar, value);
    let (drive, code) = (real(rest.drive), literal::integer(ir.supervision.rest));
    Ok(core::array::from_fn(|leg| {
        let displacement = real(rest.displacement[leg]);
        let rate = matches!(ir.hysteresis.rate, Some(RateModel::DynamicPreisach { .. })).then(|| {
            let rate = real(rest.rate[leg]);
            quote! { , #rate }
        });
        AtRest { memory: quote! { Memory::risen(#drive, #displacement #rate) }, displacement, code: code.clone() }
    }))
}

/// First line of the documentation of a reset.
pub fn doc(ir: &Ir) -> &'static str {
    if ir.supervision.risen.is_none() {
        " Reset: lowest voltage after a sweep to the highest and back, gauges zeroed there, no correction."
    } else {
        " Reset: at `supervisor.rest_voltage`, risen to it from the lowest voltage after a sweep to the highest and back, gauges zeroed at the lowest, no correction."
    }
}
