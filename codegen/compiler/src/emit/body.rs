//! `src/body.rs`: constants of the inverse dynamics. Reads [`ir::Dynamics`](crate::ir::Dynamics); exports `PLATFORM`, which the
//! law's `dynamics.rs` works with.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::{DynamicsLeg, Ir};

pub fn emit(ir: &Ir) -> TokenStream {
    let d = &ir.dynamics;
    let real = |value| literal::real(ir.scalar, value);
    let reals = |values: &[f64]| literal::reals(ir.scalar, values);
    let legs = d.legs.iter().map(|of| leg(ir, of));
    let places = d.places.map(literal::count);
    let rows = d.rows.map(literal::count);
    let (flat_base, flat_platform) = (d.flat_base, d.flat_platform);
    let (base_depth, mass, gravity) = (real(d.base_depth), real(d.mass), real(d.gravity));
    let (pole, first_moment, pole_moment) = (reals(&d.pole), reals(&d.first_moment), reals(&d.pole_moment));
    let second_moment = literal::vectors(ir.scalar, &d.second_moment);
    let (extensible_moment, leg_inertia, leg_weight_moment) =
        (real(d.extensible_moment), real(d.leg_inertia), real(d.leg_weight_moment));
    let pivots_doc = format!(
        " Over the declared workspace the smallest pivot of the elimination is {:.3} of the largest or more.",
        d.pivot_ratio
    );
    quote! {
        #![doc = " What the inverse dynamics know of the platform and its legs."]

        use specgen_runtime::Platform;
        use specgen_runtime::dynamics::Leg;

        use crate::Real;

        /// Constants of the platform; from `geometry`, `platform` and `leg`.
        ///
        #[doc = #pivots_doc]
        pub const PLATFORM: Platform<Real> = Platform {
            legs: [#(#legs),*],
            places: [#(#places),*],
            rows: [#(#rows),*],
            flat_base: #flat_base,
            flat_platform: #flat_platform,
            base_depth: #base_depth,
            pole: [#pole],
            mass: #mass,
            first_moment: [#first_moment],
            pole_moment: [#pole_moment],
            second_moment: #second_moment,
            extensible_moment: #extensible_moment,
            leg_inertia: #leg_inertia,
            leg_weight_moment: #leg_weight_moment,
            gravity: #gravity,
        };
    }
}

fn leg(ir: &Ir, leg: &DynamicsLeg) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let vector = |value: &[f64; 3]| literal::reals(ir.scalar, value);
    let (base, joint, arm, rest) = (vector(&leg.base), vector(&leg.joint), vector(&leg.arm), vector(&leg.rest));
    let (length, inverse_length) = (real(leg.length), real(leg.inverse_length));
    let half_inverse_square = real(leg.half_inverse_square);
    quote! {
        Leg {
            base: [#base],
            joint: [#joint],
            arm: [#arm],
            rest: [#rest],
            length: #length,
            inverse_length: #inverse_length,
            half_inverse_square: #half_inverse_square,
        }
    }
}
