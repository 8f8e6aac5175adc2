//! `src/sensing.rs`: gauge words to pose and its rate. Reads [`ir::Sensing`](crate::ir::Sensing); exports `faults`, `readings`,
//! `pose` and `RATE`. Only for controllers that see the platform.

use proc_macro2::TokenStream;
use quote::quote;

use super::{gauge_converter, literal};
use crate::ir::{Ir, Sensing};

pub fn emit(ir: &Ir, s: &Sensing) -> TokenStream {
    let scalar = ir.scalar;
    let converter = gauge_converter::emit(ir);
    let vectors = |rows| literal::vectors(scalar, rows);
    let (direction, normal) = (vectors(&s.direction), vectors(&s.normal));
    let (skew, pierced) = (vectors(&s.skew), vectors(&s.pierced));
    let inverse = literal::matrix(scalar, &s.inverse);
    let curvature = literal::matrix(scalar, &s.curvature);
    let passes = literal::count(s.passes as usize);
    let arc_sine = literal::reals(scalar, &s.arc_sine);
    let arc_tangent = literal::reals(scalar, &s.arc_tangent);
    let limits = s.raw_limits.iter().map(|limits| literal::reals(scalar, limits));
    let (keep, gain) = (literal::real(scalar, s.rate_keep), literal::real(scalar, s.rate_gain));
    let passes_doc = format!(
        " Lines and planes at rest; the passes leave {:.1e} m and {:.1e} rad over the declared workspace. From `gauge` and \
         `workspace`.",
        s.remainder[0], s.remainder[1]
    );
    let (unit, import, calibration, convert) = match &s.calibration {
        None => ("m", quote! {}, quote! {}, quote! { *raw }),
        Some(of_gauge) => {
            let count = literal::count(of_gauge[0].len());
            let rows = of_gauge.iter().map(|coefficients| literal::reals(scalar, coefficients));
            let constant = quote! {
                /// V to m, lowest power first; from `gauge.calibration`.
                const CALIBRATION: Calibration<Real, #count> = Calibration { coefficients: [#([#rows]),*] };
            };
            ("V", quote! { use specgen_runtime::Calibration; }, constant, quote! { CALIBRATION.readings(raw) })
        }
    };
    let raw_doc = format!(
        " Lowest and highest word of each gauge that is believed, {unit}: readings within `sensor.range`, where the gauge means one \
         reading by one word."
    );
    let readings_doc = format!(" Readings of the gauges, m, from their words in {unit}.");
    quote! {
        #![doc = " Pose from six gauges that see the platform, and the filter of its rate."]

        #import
        use specgen_runtime::{GaugeConverter, Gauges, RateFilter, sensing};

        use crate::Real;

        #[doc = #passes_doc]
        pub const GAUGES: Gauges<'static, Real> = Gauges {
            direction: #direction,
            normal: #normal,
            skew: #skew,
            pierced: #pierced,
            inverse: #inverse,
            curvature: #curvature,
            passes: #passes,
            arc_sine: &[#arc_sine],
            arc_tangent: &[#arc_tangent],
        };
        #calibration
        #[doc = #raw_doc]
        pub const RAW_LIMITS: [[Real; 2]; 6] = [#([#limits]),*];
        /// First-order filter of the pose's rate; from `velocity_cutoff` and `timing.period`.
        pub const RATE: RateFilter<Real> = RateFilter { keep: #keep, gain: #gain };

        #converter

        /// Gauges whose word is not finite or out of [`RAW_LIMITS`]: bit k for gauge k.
        #[inline]
        #[must_use]
        pub fn faults(raw: &[Real; 6]) -> u32 {
            sensing::faults(raw, &RAW_LIMITS)
        }

        #[doc = #readings_doc]
        #[inline]
        #[must_use]
        pub fn readings(raw: &[Real; 6]) -> [Real; 6] {
            #convert
        }

        /// Pose [x y z θx θy θz] from rest (m, rad) of gauge words without [`faults`]; finite for these.
        #[inline]
        #[must_use]
        pub fn pose(raw: &[Real; 6]) -> [Real; 6] {
            GAUGES.pose(&readings(raw))
        }
    }
}
