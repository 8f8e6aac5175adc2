//! `src/kinematics.rs`: pose to leg displacements and back. Reads [`ir::Kinematics`](crate::ir::Kinematics) and the pose
//! bounds; exports `pose_is_accepted`, `leg_displacements`, `pose_from_legs` and the constants of the legs.

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
    let newton_steps = literal::count(k.newton_steps as usize);
    let corrections = literal::count(k.corrections as usize);
    let steps_doc = format!(
        " Joints, rest lengths and series; the Newton steps bring |Δl| ≤ {:.3e} m to the last bit of the scalar. From \
         `geometry` and `workspace`.",
        k.largest_displacement
    );
    quote! {
        #![doc = " Leg kinematics in difference form: leg displacements from rest, without the cancellation of |r| − l₀, and the pose"]
        #![doc = " that has them."]

        use specgen_runtime::{Legs, Series};

        use crate::{LEGS, Real};

        #[doc = #steps_doc]
        pub const GEOMETRY: Legs<'static, Real> = Legs {
            rest_leg: #rest_leg,
            platform_joint: #platform_joint,
            rest_length: [#rest_length],
            series: SERIES,
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
        const CORRECTIONS: usize = #corrections;

        /// Every component is finite and within the declared workspace.
        #[inline]
        #[must_use]
        pub fn pose_is_accepted(pose: &[Real; 6]) -> bool {
            pose.iter().zip(&POSE_BOUND).all(|(value, bound)| (-*bound..=*bound).contains(value))
        }

        /// Δl_i = |P₀ + t + R P_i − B_i| − l₀ of each leg, m, positive when it gets longer.
        ///
        /// `pose` is [x y z θx θy θz] from rest: translation t of P_C in {B} (m) and rotation R = Rz(θz) Ry(θy) Rx(θx) about
        /// fixed axes (AI.1) (rad), within the declared workspace.
        #[inline]
        #[must_use]
        pub fn leg_displacements(pose: &[Real; 6]) -> [Real; LEGS] {
            GEOMETRY.displacements(pose)
        }

        /// The pose at which the legs have these displacements (m): the inverse of [`leg_displacements`] within the declared
        /// workspace.
        #[inline]
        #[must_use]
        pub fn pose_from_legs(displacements: &[Real; LEGS]) -> [Real; 6] {
            GEOMETRY.pose(&INVERSE_JACOBIAN, CORRECTIONS, displacements)
        }
    }
}
