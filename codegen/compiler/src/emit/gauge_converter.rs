//! `gauge_reading` of `src/sensing.rs`. Reads [`ir::GaugeConverter`](crate::ir::GaugeConverter).

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::{Ir, TaskSpace};

/// Imports come from the caller: `GaugeConverter` and `Real`.
pub fn emit(ir: &Ir) -> TokenStream {
    let converter = &ir.gauge_converter;
    let (at_zero, per_code) =
        (literal::real(ir.scalar, converter.at_zero), literal::real(ir.scalar, converter.per_code));
    let highest = literal::integer(converter.highest);
    let beyond = literal::reals(ir.scalar, &converter.beyond);
    let calibrated = ir.task_space.as_ref().is_some_and(|TaskSpace { sensing, .. }| sensing.calibration.is_some());
    let unit = if calibrated { "V" } else { "m" };
    let doc = format!(
        " What a gauge's converter means by a code of 0..2^bits, {unit}; a code at either end is a gauge fault."
    );
    quote! {
        /// Codes of the gauges' converters; from `sensor`.
        pub const CONVERTER: GaugeConverter<Real> = GaugeConverter {
            at_zero: #at_zero,
            per_code: #per_code,
            highest: #highest,
            beyond: [#beyond],
        };
        #[doc = #doc]
        #[inline]
        #[must_use]
        pub fn gauge_reading(code: i32) -> Real {
            CONVERTER.reading(code)
        }
    }
}
