//! `src/kinematics.rs`: pose to leg displacements. Reads [`ir::Kinematics`](crate::ir::Kinematics) and the pose bounds;
//! exports `pose_is_accepted` and `leg_displacements`.

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let k = &ir.kinematics;
    let real = |value| literal::real(ir.scalar, value);
    let rest_leg = literal::vectors(ir.scalar, &k.rest_leg);
    let platform_joint = literal::vectors(ir.scalar, &k.platform_joint);
    let rest_length = literal::reals(ir.scalar, &k.rest_length);
    let pose_bound = literal::reals(ir.scalar, &ir.bounds.pose);
    let sine = horner(quote! { 1.0 }, k.sine.iter().map(|c| real(*c)).collect());
    let versine = match k.versine.split_first() {
        Some((first, rest)) => horner(real(*first), rest.iter().map(|c| real(*c)).collect()),
        None => quote! { 0.0 },
    };
    let newton_steps = literal::count(k.newton_steps as usize);
    let steps_doc =
        format!(" Newton steps for Δl: bring |Δl| ≤ {:.3e} m to the last bit of the scalar.", k.largest_displacement);
    quote! {
        #![doc = " Leg kinematics in difference form: leg displacements from rest, without the cancellation of |r| − l₀."]

        use crate::{LEGS, Real};

        /// Leg vectors at rest r₀ = P₀ + P_i − B_i (AI.2), base frame, m; from `geometry`.
        const REST_LEG: [[Real; 3]; LEGS] = #rest_leg;
        /// Platform joints P_i (2), (AI.4), platform frame, m; from `geometry`.
        const PLATFORM_JOINT: [[Real; 3]; LEGS] = #platform_joint;
        /// Leg lengths at rest l₀ = |r₀|, m.
        const REST_LENGTH: [Real; LEGS] = [#rest_length];
        /// Largest |x|, |y|, |z| (m) and |θx|, |θy|, |θz| (rad) accepted; from `workspace`.
        const POSE_BOUND: [Real; 6] = [#pose_bound];
        #[doc = #steps_doc]
        const NEWTON_STEPS: usize = #newton_steps;

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
            let [x, y, z, tilt_x, tilt_y, tilt_z] = *pose;
            let turn = rotation_less_identity(tilt_x, tilt_y, tilt_z);
            let mut displacements = [0.0; LEGS];
            for leg in 0..LEGS {
                let p = PLATFORM_JOINT[leg];
                let moved = [
                    x + turn[0][0] * p[0] + turn[0][1] * p[1] + turn[0][2] * p[2],
                    y + turn[1][0] * p[0] + turn[1][1] * p[1] + turn[1][2] * p[2],
                    z + turn[2][0] * p[0] + turn[2][1] * p[1] + turn[2][2] * p[2],
                ];
                displacements[leg] = extension(&REST_LEG[leg], REST_LENGTH[leg], &moved);
            }
            displacements
        }

        /// |r₀ + d| − l₀ for a joint that moved by d: the root Δl of Δl² + 2 l₀ Δl = s with s = (2 r₀ + d)·d.
        #[inline]
        fn extension(rest: &[Real; 3], length: Real, moved: &[Real; 3]) -> Real {
            let s = (2.0 * rest[0] + moved[0]) * moved[0]
                + (2.0 * rest[1] + moved[1]) * moved[1]
                + (2.0 * rest[2] + moved[2]) * moved[2];
            let mut root = s / (2.0 * length);
            for _ in 0..NEWTON_STEPS {
                root = (s + root * root) / (2.0 * (length + root));
            }
            root
        }

        /// R − I for R = Rz Ry Rx (AI.1), with 1 − cos as one number so that nothing cancels.
        #[inline]
        fn rotation_less_identity(tilt_x: Real, tilt_y: Real, tilt_z: Real) -> [[Real; 3]; 3] {
            let (sx, sy, sz) = (sine(tilt_x), sine(tilt_y), sine(tilt_z));
            let (vx, vy, vz) = (versine(tilt_x), versine(tilt_y), versine(tilt_z));
            let (cx, cy, cz) = (1.0 - vx, 1.0 - vy, 1.0 - vz);
            [
                [vy * vz - vy - vz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
                [cy * sz, sx * sy * sz + (vx * vz - vx - vz), cx * sy * sz - sx * cz],
                [-sy, sx * cy, vx * vy - vx - vy],
            ]
        }

        /// sin θ by its series, to the last bit over the declared workspace.
        #[inline]
        fn sine(angle: Real) -> Real {
            let square = angle * angle;
            angle * (#sine)
        }

        /// 1 − cos θ by its series, to the last bit over the declared workspace.
        #[inline]
        fn versine(angle: Real) -> Real {
            let square = angle * angle;
            square * (#versine)
        }
    }
}

/// first + square·(c₁ + square·(c₂ + …)).
fn horner(first: TokenStream, rest: Vec<TokenStream>) -> TokenStream {
    let tail = rest.into_iter().rev().fold(None, |inner, c| match inner {
        None => Some(c),
        Some(inner) => Some(quote! { (#c + square * #inner) }),
    });
    match tail {
        Some(tail) => quote! { #first + square * #tail },
        None => first,
    }
}
