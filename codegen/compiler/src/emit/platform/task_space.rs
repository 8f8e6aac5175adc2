//! `src/task_space.rs`: constants of the control law in task space. Reads [`ir::TaskSpace`](crate::ir::TaskSpace).

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::literal;
use crate::ir::{Ir, Notch, TaskSpace};

pub fn emit(ir: &Ir, task: &TaskSpace) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let six = |values: &[f64; 6]| literal::reals(ir.scalar, values);
    let matrix = |rows: &[[f64; 6]; 6]| {
        let rows = rows.iter().map(|row| literal::reals(ir.scalar, row));
        quote! { [#([#rows]),*] }
    };
    let law = &task.law;
    let (period, compliance) = (real(law.period), real(law.compliance));
    let (wrench_to_legs, legs_to_wrench) = (matrix(&law.wrench_to_legs), matrix(&law.legs_to_wrench));
    let force_to_modes = matrix(&law.force_to_modes);
    let (legs_to_modes, modes_to_legs) = (matrix(&law.legs_to_modes), matrix(&law.modes_to_legs));
    let (rest_force, wrench_limit) = (six(&law.rest_force), six(&law.wrench_limit));
    let (keep, negligible) = (real(law.transfer_keep), real(law.transfer_negligible));
    let (cells_per_metre, metres_per_cell) = (real(law.cells_per_metre), real(law.metres_per_cell));
    let lead = real(law.lead);
    let lead = quote! {
        /// Lead of the leg displacements, in periods; from `control.lead`. Zero: none.
        pub const LEAD: Real = #lead;
    };
    let notch = match &law.notch {
        None => without_notch(),
        Some(notch) => with_notch(ir, notch, &matrix),
    };
    let imports = if law.notch.is_some() {
        quote! {
            use specgen_runtime::linear::transform;
            use specgen_runtime::{NotchState, Section};
        }
    } else {
        quote! { use specgen_runtime::NotchState; }
    };
    quote! {
        #![doc = " Constants of the control law (7) in task space, at rest; from `actuator`, `control` and the dynamics."]

        #imports

        use crate::{LEGS, Real};

        /// T_s, s; from `timing.period`.
        pub const PERIOD: Real = #period;
        /// 1/k_a, m/N; from `actuator.axial_stiffness`.
        pub const COMPLIANCE: Real = #compliance;
        /// J⁻ᵀ/k_a at rest: generalised force on the platform to the displacement of each leg that it takes, m/N and 1/N.
        pub const WRENCH_TO_LEGS: [[Real; 6]; LEGS] = #wrench_to_legs;
        /// k_a Jᵀ at rest, its inverse: N/m and N.
        pub const LEGS_TO_WRENCH: [[Real; 6]; 6] = #legs_to_wrench;
        /// V⁻¹ K⁻¹ with K = Jᵀ k_a J: generalised force to the deflection it makes, in modal coordinates.
        pub const FORCE_TO_MODES: [[Real; 6]; 6] = #force_to_modes;
        /// V⁻¹ J⁻¹: leg displacements to modal coordinates.
        pub const LEGS_TO_MODES: [[Real; 6]; 6] = #legs_to_modes;
        /// J V: the modes as leg displacements.
        pub const MODES_TO_LEGS: [[Real; 6]; LEGS] = #modes_to_legs;
        /// Leg forces under which the gauges were zeroed: gravity at rest, N.
        pub const REST_FORCE: [Real; LEGS] = [#rest_force];
        /// Largest |component| of the measured wrench that is believed, N and N m; from `control.interaction`.
        pub const WRENCH_LIMIT: [Real; 6] = [#wrench_limit];
        #lead
        /// Part of the offset of a change of mode that is left after a tick; from `control.transfer_time`.
        pub const TRANSFER_KEEP: Real = #keep;
        /// Offset of a change of mode below which it is over, m.
        pub const TRANSFER_NEGLIGIBLE: Real = #negligible;

        /// u = q/ρ̂ for a displacement q (m), as drive in cells of the Everett grid.
        #[inline]
        #[must_use]
        pub fn linear_drive(displacement: Real) -> Real {
            displacement * #cells_per_metre
        }

        /// ρ̂u for a drive u in cells of the Everett grid, m.
        #[inline]
        #[must_use]
        pub fn linear_displacement(drive: Real) -> Real {
            drive * #metres_per_cell
        }

        #notch
    }
}

/// Coordinates of the pose stand for the modal ones: V is the identity.
fn without_notch() -> TokenStream {
    quote! {
        /// The error as it is: the spec declares no notch, and its modal coordinates are those of the pose.
        #[inline]
        #[must_use]
        pub fn modal_error(error: &[Real; 6]) -> [Real; 6] {
            *error
        }

        /// The error as it is: the spec declares no notch.
        #[inline]
        #[must_use]
        pub fn notch_error(_notch: &mut NotchState<Real>, error: &[Real; 6]) -> [Real; 6] {
            *error
        }

        /// The innovation as it is: the spec declares no notch.
        #[inline]
        #[must_use]
        pub fn notch_innovation(_notch: &mut NotchState<Real>, innovation: &[Real; 6]) -> [Real; 6] {
            *innovation
        }
    }
}

fn with_notch(ir: &Ir, notch: &Notch, matrix: &dyn Fn(&[[f64; 6]; 6]) -> TokenStream) -> TokenStream {
    let sections = notch.sections.iter().map(|section| {
        let (depth, a) = (literal::real(ir.scalar, section.depth), literal::reals(ir.scalar, &section.a));
        quote! { Section { depth: #depth, a: [#a] } }
    });
    let (pose_to_modes, modes_to_pose) = (matrix(&notch.pose_to_modes), matrix(&notch.modes_to_pose));
    quote! {
        /// Notch of each mode; from `control.notch_damping`.
        pub const NOTCH: [Section<Real>; 6] = [#(#sections),*];
        /// V⁻¹: pose to modal coordinates.
        pub const POSE_TO_MODES: [[Real; 6]; 6] = #pose_to_modes;
        /// V: the modes as poses.
        pub const MODES_TO_POSE: [[Real; 6]; 6] = #modes_to_pose;

        /// V⁻¹ e: the pose error in modal coordinates.
        #[inline]
        #[must_use]
        pub fn modal_error(error: &[Real; 6]) -> [Real; 6] {
            transform(&POSE_TO_MODES, error)
        }

        /// N(e) of a modal error, m and rad.
        #[inline]
        #[must_use]
        pub fn notch_error(notch: &mut NotchState<Real>, modal_error: &[Real; 6]) -> [Real; 6] {
            transform(&MODES_TO_POSE, &notch.filter(&NOTCH, modal_error))
        }

        /// N of an innovation in modal coordinates.
        #[inline]
        #[must_use]
        pub fn notch_innovation(notch: &mut NotchState<Real>, innovation: &[Real; 6]) -> [Real; 6] {
            notch.filter(&NOTCH, innovation)
        }
    }
}
