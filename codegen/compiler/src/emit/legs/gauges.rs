//! `src/gauges.rs` of six legs: the codes of the gauges' converters, and the ranges of valid readings.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{gauge_converter, literal};
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let converter = gauge_converter::emit(ir);
    let (gauge, setpoint) = (literal::reals(ir.scalar, &ir.bounds.sensor), literal::reals(ir.scalar, &ir.bounds.leg));
    quote! {
        #![doc = " Readings and set-points of the legs: the ranges that are accepted."]

        use specgen_runtime::GaugeConverter;

        use crate::Real;

        #converter
        /// Leg set-points outside this range are faults, m; from `actuator.stroke`.
        pub const LEG_SETPOINT: [Real; 2] = [#setpoint];
        /// Lowest and highest plausible reading of each gauge, m; from `sensor.range`.
        pub const RAW_LIMITS: [[Real; 2]; 6] = [[#gauge]; 6];
    }
}
