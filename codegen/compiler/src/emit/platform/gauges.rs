//! `src/gauges.rs` of a platform: constants of its gauges. Reads [`ir::Sensing`](crate::ir::Sensing); used by the law's
//! `sensing.rs`.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{gauge_converter, literal};
use crate::ir::{Ir, Sensing};

pub fn emit(ir: &Ir, s: &Sensing) -> TokenStream {
    let scalar = ir.scalar;
    let converter = gauge_converter::emit(ir);
    let gauges = literal::constant!(scalar, gauges, s);
    let limits = s.raw_limits.iter().map(|limits| literal::reals(scalar, limits));
    let rate = literal::constant!(scalar, rate_filter, s);
    let passes_doc = format!(
        " Lines and planes at rest; the passes leave {:.1e} m and {:.1e} rad over the declared workspace. From `gauge` and \
         `workspace`.",
        s.remainder[0], s.remainder[1]
    );
    let (unit, coefficients, calibration) = match &s.calibration {
        None => ("m", 1, quote! { None }),
        Some(of_gauge) => {
            let rows = of_gauge.iter().map(|coefficients| literal::reals(scalar, coefficients));
            ("V", of_gauge[0].len(), quote! { Some(Calibration { coefficients: [#([#rows]),*] }) })
        }
    };
    let coefficients = literal::count(coefficients);
    let raw_doc = format!(
        " Lowest and highest valid word of each gauge, {unit}: readings within `sensor.range`, where words and readings \
         correspond one to one."
    );
    quote! {
        #![doc = " Six gauges that measure the platform: positions, conversion of their words, and the filter of the pose's rate."]

        use specgen_runtime::{Calibration, GaugeConverter, Gauges, RateFilter};

        use crate::Real;

        #[doc = #passes_doc]
        pub const GAUGES: Gauges<'static, Real> = #gauges;
        /// Words in V to readings in m, lowest power first; from `gauge.calibration`. Without one a word is a reading.
        pub const CALIBRATION: Option<Meaning> = #calibration;
        /// Conversion of the gauge words, with this number of coefficients each.
        pub type Meaning = Calibration<Real, #coefficients>;
        #[doc = #raw_doc]
        pub const RAW_LIMITS: [[Real; 2]; 6] = [#([#limits]),*];
        /// First-order filter of the pose's rate; from `velocity_cutoff` and `timing.period`.
        pub const RATE: RateFilter<Real> = #rate;

        #converter
    }
}
