//! `src/dynamics.rs`: constants of the inverse dynamics and thin functions over the runtime's kernel. Reads
//! [`ir::Dynamics`](crate::ir::Dynamics); exports `PLATFORM`, `leg_forces`, `load` and the functions for analysis.

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
        #![doc = " Inverse dynamics: motion of the platform to leg forces and leg displacements."]
        #![doc = ""]
        #![doc = " Poses are from rest, [x y z θx θy θz] in m and rad; rates and accelerations are their time derivatives. The model and its range are"]
        #![doc = " in `specgen_runtime::dynamics`: angles up to π/4 and leg lengths within ±30 %; the controller accepts poses of the declared workspace only."]

        use specgen_runtime::dynamics::Leg;
        use specgen_runtime::{Platform, Real as _};

        pub use specgen_runtime::{Load, Motion};

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

        /// Six leg forces for a motion, N, > 0 pushes the platform: J⁻ᵀ (M ḧ + C ḣ + G).
        #[inline]
        #[must_use]
        pub fn leg_forces(motion: &Motion<Real>) -> [Real; 6] {
            PLATFORM.leg_forces(motion)
        }

        /// Leg displacements (m) and leg forces (N) for a motion, under a wrench on the platform if there is one: force (N) and torque (N m) about
        /// P_C, base axes.
        #[inline]
        #[must_use]
        pub fn load(motion: &Motion<Real>, wrench: Option<&[Real; 6]>) -> Load<Real> {
            PLATFORM.load(motion, wrench)
        }

        /// M(h): kg, kg m, kg m². For analysis.
        #[inline]
        #[must_use]
        pub fn mass_matrix(pose: &[Real; 6]) -> [[Real; 6]; 6] {
            PLATFORM.mass_matrix(pose)
        }

        /// C(h, ḣ) ḣ: N, N m. For analysis.
        #[inline]
        #[must_use]
        pub fn coriolis(pose: &[Real; 6], rate: &[Real; 6]) -> [Real; 6] {
            PLATFORM.coriolis(pose, rate)
        }

        /// G(h): N, N m. For analysis.
        #[inline]
        #[must_use]
        pub fn gravity(pose: &[Real; 6]) -> [Real; 6] {
            PLATFORM.gravity(pose)
        }

        /// J(h) = ∂l/∂h, a row per leg: m/m, m/rad. For analysis.
        #[inline]
        #[must_use]
        pub fn jacobian(pose: &[Real; 6]) -> [[Real; 6]; 6] {
            PLATFORM.jacobian(pose)
        }

        /// Words of a motion: pose, rate, acceleration.
        pub const MOTION_WORDS: usize = 18;
        /// Words of an analysis: J and M row by row, C ḣ, G, leg forces, leg displacements.
        pub const ANALYSIS_WORDS: usize = 96;

        /// All of the above for one motion, as words, for tools on a host.
        #[must_use]
        pub fn analysis(words: &[u64; MOTION_WORDS]) -> [u64; ANALYSIS_WORDS] {
            let number = |k: usize| Real::from_word(words[k]);
            let six = |k: usize| [number(k), number(k + 1), number(k + 2), number(k + 3), number(k + 4), number(k + 5)];
            let motion = Motion { pose: six(0), rate: six(6), acceleration: six(12) };
            let load = load(&motion, None);
            let rows = [coriolis(&motion.pose, &motion.rate), gravity(&motion.pose), leg_forces(&motion), load.displacement];
            let (jacobian, mass) = (jacobian(&motion.pose), mass_matrix(&motion.pose));
            let mut out = [0; ANALYSIS_WORDS];
            let values = jacobian.iter().chain(&mass).chain(&rows).flatten();
            for (word, value) in out.iter_mut().zip(values) {
                *word = value.to_word();
            }
            out
        }
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
