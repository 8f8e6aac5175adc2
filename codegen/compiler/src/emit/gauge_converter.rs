//! `CONVERTER` of `src/gauges.rs`. Reads [`ir::GaugeConverter`](crate::ir::GaugeConverter).

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

/// Imports come from the caller: `GaugeConverter` and `Real`.
pub fn emit(ir: &Ir) -> TokenStream {
    let converter = &ir.gauge_converter;
    let (at_zero, per_code) =
        (literal::real(ir.scalar, converter.at_zero), literal::real(ir.scalar, converter.per_code));
    let highest = literal::integer(converter.highest);
    let beyond = literal::reals(ir.scalar, &converter.beyond);
    let calibrated = ir.task_space.as_ref().is_some_and(|task| task.sensing.calibration.is_some());
    let doc = format!(
        " Conversion of a gauge converter's code, 0..2^bits, to {}; a code at either end is a gauge fault. From `sensor`.",
        if calibrated { "V" } else { "m" }
    );
    quote! {
        #[doc = #doc]
        pub const CONVERTER: GaugeConverter<Real> = GaugeConverter {
            at_zero: #at_zero,
            per_code: #per_code,
            highest: #highest,
            beyond: [#beyond],
        };
    }
}
