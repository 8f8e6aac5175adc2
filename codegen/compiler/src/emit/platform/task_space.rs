//! `src/task_space.rs`: constants of the control law in task space. Reads [`ir::TaskSpace`](crate::ir::TaskSpace).

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::literal;
use crate::ir::{Ir, TaskSpace};

pub fn emit(ir: &Ir, task: &TaskSpace) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let six = |values: &[f64; 6]| literal::reals(ir.scalar, values);
    let matrix = |rows: &[[f64; 6]; 6]| literal::matrix(ir.scalar, rows);
    let law = &task.law;
    let load = literal::constant!(ir.scalar, affine, &task.load);
    let cross_talk = task.load.cross_talk.as_ref().map_or(quote! { None }, |rows| {
        let rows = matrix(rows);
        quote! { Some(#rows) }
    });
    let load_doc = format!(
        " To first order inertia and gravity deflect the legs by P h + Q ḧ: at most {:.3e} m off in moves and trajectories, {:.1e} in stops; \
         from `control.dynamics`. None: by the whole kernel.",
        task.load.bounds[0].error, task.load.bounds[1].error
    );
    let (period, compliance) = (real(law.period), real(law.compliance));
    let (wrench_to_legs, legs_to_wrench) = (matrix(&law.wrench_to_legs), matrix(&law.legs_to_wrench));
    let force_to_modes = matrix(&law.force_to_modes);
    let (legs_to_modes, modes_to_legs) = (matrix(&law.legs_to_modes), matrix(&law.modes_to_legs));
    let (rest_force, wrench_limit) = (six(&law.rest_force), six(&law.wrench_limit));
    let (keep, negligible) = (real(law.transfer_keep), real(law.transfer_negligible));
    let (cells_per_metre, metres_per_cell) = (real(law.cells_per_metre), real(law.metres_per_cell));
    let lead = real(law.lead);
    let own_leads: Vec<_> = law.own_leads.iter().map(|lead| real(*lead)).collect();
    let hands_over = law.hands_over;
    let led = proc_macro2::Literal::usize_unsuffixed(own_leads.len());
    let notch = literal::constant!(ir.scalar, notch, law);
    let import_section = law.notch.as_ref().map(|_| quote! { , Section });
    let [damped, corrected] =
        [law.damping.is_some(), law.correction.is_some()].map(|given| literal::count(if given { 6 } else { 0 }));
    let none = quote! { [] };
    let damping = law.damping.map_or(none.clone(), |sections| literal::constant!(ir.scalar, damping, &sections));
    let correction = law.correction.map_or(none, |limits| literal::constant!(ir.scalar, correction, &limits));
    quote! {
        #![doc = " Constants of the control law (7) in task space, at rest; from `actuator`, `control` and the dynamics."]

        use specgen_runtime::{Affine, CorrectionLimit, Notch, Resonator #import_section};

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
        #[doc = #load_doc]
        pub const AFFINE_LOAD: Option<Affine<Real>> = #load;
        /// E J: cross-talk of the legs, beside the whole kernel, m/m and m/rad; from `actuator.cross_talk`.
        pub const CROSS_TALK: Option<[[Real; 6]; LEGS]> = #cross_talk;
        /// Leg forces under which the gauges were zeroed: gravity at rest, N.
        pub const REST_FORCE: [Real; LEGS] = [#rest_force];
        /// Largest plausible |component| of the measured wrench, N and N m; from `control.interaction`.
        pub const WRENCH_LIMIT: [Real; 6] = [#wrench_limit];
        /// Lead of the leg displacements, in periods; from `control.lead`. Zero: none.
        pub const LEAD: Real = #lead;
        /// Number of trajectories with their own lead: all or none; from `trajectory.lead`.
        pub const LED: usize = #led;
        /// Lead of each, in periods.
        pub const OWN_LEADS: [Real; LED] = [#(#own_leads),*];
        /// Fraction of the offset of a change of mode left after a tick; from `control.transfer_time`.
        pub const TRANSFER_KEEP: Real = #keep;
        /// Offset of a change of mode below which it is over, m.
        pub const TRANSFER_NEGLIGIBLE: Real = #negligible;

        /// 1/ρ̂ in cells of the Everett grid, 1/m.
        pub const CELLS_PER_METRE: Real = #cells_per_metre;
        /// ρ̂ in cells of the Everett grid, m.
        pub const METRES_PER_CELL: Real = #metres_per_cell;
        /// Notch of each mode; from `control.notch_damping`. Without one, modal coordinates are those of the pose.
        pub const NOTCH: Option<Notch<Real>> = #notch;
        /// Modes with active damping; from `control.active_damping`.
        pub const DAMPED: usize = #damped;
        /// Active damping of each.
        pub const DAMPING: [Resonator<Real>; DAMPED] = #damping;
        /// Whether the integral is handed to the estimates when the set-point comes to rest; from `control.hand_over`.
        pub const HANDS_OVER: bool = #hands_over;
        /// Axes with a correction of the request; from `control.correction`.
        pub const CORRECTED: usize = #corrected;
        /// Largest correction of each axis, and its largest rate.
        pub const CORRECTION: [CorrectionLimit<Real>; CORRECTED] = #correction;
    }
}
