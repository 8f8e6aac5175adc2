//! `src/geometry.rs`: constants of the leg kinematics. Reads [`ir::Kinematics`](crate::ir::Kinematics) and the pose bounds; the law's
//! `kinematics.rs` works with them.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let k = &ir.kinematics;
    let rest_leg = literal::vectors(ir.scalar, &k.rest_leg);
    let platform_joint = literal::vectors(ir.scalar, &k.platform_joint);
    let rest_length = literal::reals(ir.scalar, &k.rest_length);
    let pose_bound = literal::reals(ir.scalar, &ir.bounds.pose);
    let sine = literal::reals(ir.scalar, &k.sine);
    let versine = literal::reals(ir.scalar, &k.versine);
    let inverse = literal::matrix(ir.scalar, &k.inverse_jacobian);
    let root = literal::reals(ir.scalar, &k.root);
    let newton_steps = literal::count(k.newton_steps as usize);
    let corrections = literal::count(k.corrections as usize);
    let steps_doc = format!(
        " Joints, rest lengths and series; that of the root, and Newton's steps, bring |Δl| ≤ {:.3e} m to the last bit of the \
         scalar. From `geometry` and `workspace`.",
        k.largest_displacement
    );
    quote! {
        #![doc = " Legs and workspace, as the kinematics need them."]

        use specgen_runtime::{Legs, Series};

        use crate::{LEGS, Real};

        #[doc = #steps_doc]
        pub const GEOMETRY: Legs<'static, Real> = Legs {
            rest_leg: #rest_leg,
            platform_joint: #platform_joint,
            rest_length: [#rest_length],
            series: SERIES,
            root: &[#root],
            newton_steps: #newton_steps,
        };
        /// Sine and versine to the last bit over the declared workspace.
        pub const SERIES: Series<'static, Real> = Series { sine: &[#sine], versine: &[#versine] };
        /// J⁻¹ of the legs at rest: pose coordinates (rows) per leg displacement (columns), m/m and rad/m; J = ∂l/∂h.
        pub const INVERSE_JACOBIAN: [[Real; LEGS]; 6] = #inverse;
        /// Largest |x|, |y|, |z| (m) and |θx|, |θy|, |θz| (rad) accepted; from `workspace`.
        pub(crate) const POSE_BOUND: [Real; 6] = [#pose_bound];
        /// Corrections of the forward kinematics: what they leave over the declared workspace is below 1e-13 m and rad, or
        /// the last bit.
        pub(crate) const CORRECTIONS: usize = #corrections;
    }
}
