//! `src/limits.rs`: converter and bounds on inputs. Reads [`ir::Actuation`](crate::ir::Actuation) and
//! [`ir::Bounds`](crate::ir::Bounds); exports `DAC`, the code limits and the acceptance checks.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let a = &ir.actuation;
    let (volts_at_zero, volts_per_code) = (real(a.volts_at_zero), real(a.volts_per_code));
    let (cells_at_zero, cells_per_code, codes_per_cell) =
        (real(a.cells_at_zero), real(a.cells_per_code), real(a.codes_per_cell));
    let (code_min, code_max) = (literal::integer(a.code_min), literal::integer(a.code_max));
    let dac_bits = literal::integer(a.bits.cast_signed());
    let codes_doc = format!(
        " Lowest and highest code whose voltage lies within {} V … {} V; from `actuator.voltage` and `dac`.",
        a.voltage[0], a.voltage[1]
    );
    let [leg_min, leg_max] = ir.bounds.leg.map(real);
    let [gauge_min, gauge_max] = ir.bounds.sensor.map(real);
    // A controller in task space has its own checks, in `sensing` and `setpoint`.
    let imports = if ir.task_space.is_none() {
        quote! { {LEGS, Real} }
    } else {
        quote! { Real }
    };
    let of_legs = ir.task_space.is_none().then(|| {
        quote! {
            /// Leg set-points outside this range are faults, m; from `actuator.stroke`.
            pub const LEG_SETPOINT: [Real; 2] = [#leg_min, #leg_max];
            /// Gauge readings outside this range are faults, m; from `sensor.range`.
            pub const GAUGE: [Real; 2] = [#gauge_min, #gauge_max];

            /// Every leg set-point is finite and within [`LEG_SETPOINT`].
            #[inline]
            #[must_use]
            pub fn leg_setpoint_is_accepted(displacements: &[Real; LEGS]) -> bool {
                displacements.iter().all(|value| (LEG_SETPOINT[0]..=LEG_SETPOINT[1]).contains(value))
            }

            /// A gauge reading is finite and within [`GAUGE`].
            #[inline]
            #[must_use]
            pub fn gauge_is_accepted(displacement: Real) -> bool {
                (GAUGE[0]..=GAUGE[1]).contains(&displacement)
            }
        }
    });
    quote! {
        #![doc = " What may go out and what is believed of what comes in."]

        use specgen_runtime::Dac;

        use crate::#imports;

        /// Converter codes in volts and in cells of the Everett grid; from `dac` and `actuator.voltage`.
        pub const DAC: Dac<Real> = Dac {
            volts_at_zero: #volts_at_zero,
            volts_per_code: #volts_per_code,
            cells_at_zero: #cells_at_zero,
            cells_per_code: #cells_per_code,
            codes_per_cell: #codes_per_cell,
        };
        /// Bits of a code; from `dac.bits`.
        pub const DAC_BITS: u32 = #dac_bits;
        #[doc = #codes_doc]
        pub const CODES: [i32; 2] = [#code_min, #code_max];
        #of_legs
    }
}
