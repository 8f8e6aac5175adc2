//! `src/geometry.rs`: constants of the leg kinematics. Reads [`ir::Kinematics`](crate::ir::Kinematics) and the pose bounds; used by
//! the law's `kinematics.rs`.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let k = &ir.kinematics;
    let legs = literal::constant!(ir.scalar, legs, k);
    let pose_bound = literal::reals(ir.scalar, &ir.bounds.pose);
    let inverse = literal::matrix(ir.scalar, &k.inverse_jacobian);
    let corrections = literal::count(k.corrections as usize);
    let steps_doc = format!(
        " Joints, rest lengths and series; that of the root, and Newton's steps, bring |Δl| ≤ {:.3e} m to the last bit of the \
         scalar. From `geometry` and `workspace`.",
        k.largest_displacement
    );
    quote! {
        #![doc = " Constants of legs and workspace for the kinematics."]

        use specgen_runtime::{Legs, Series};

        use crate::{LEGS, Real};

        #[doc = #steps_doc]
        pub const GEOMETRY: Legs<'static, Real> = #legs;
        /// J⁻¹ of the legs at rest: pose coordinates (rows) per leg displacement (columns), m/m and rad/m; J = ∂l/∂h.
        pub const INVERSE_JACOBIAN: [[Real; LEGS]; 6] = #inverse;
        /// Largest |x|, |y|, |z| (m) and |θx|, |θy|, |θz| (rad) accepted; from `workspace`.
        pub(crate) const POSE_BOUND: [Real; 6] = [#pose_bound];
        /// Corrections of the forward kinematics. Over the declared workspace, their error is below 1e-13 m and rad, or
        /// the last bit.
        pub(crate) const CORRECTIONS: usize = #corrections;
    }
}
