//! What the law has to know of a platform.

use specgen_runtime::dynamics;
use specgen_runtime::setpoint::{Frames, Setpoints};
use specgen_runtime::trigger::OutputLines;
use specgen_runtime::{Affine, GaugeCalibration, Gauges, ModalDamping, Notch, RateFilter, RequestCorrection};

use crate::spec::{LEGS, Spec};

/// The law of a platform in task space.
#[derive(Debug, Clone, Copy)]
pub struct TaskSpace;

/// Constants of a platform in task space, and the types of what has a size of its own. One accessor for each constant: of one struct
/// with all of them the compiler makes slower code.
pub trait Platform: Spec<Law = TaskSpace> {
    /// Active damping, or none.
    type Damping: ModalDamping<Self::Real>;
    /// Correction of the request, or none.
    type Correction: RequestCorrection<Self::Real>;
    /// Output lines, or none.
    type Lines: OutputLines<Self::Real>;
    /// The user's frames.
    type Frames: Frames<Self::Real>;
    /// What the gauges' words mean.
    type Calibration: GaugeCalibration<Self::Real>;

    /// T_s, s.
    fn period(&self) -> Self::Real;
    /// 1/k_a, m/N.
    fn compliance(&self) -> Self::Real;
    /// J⁻ᵀ/k_a at rest: generalised force on the platform to the displacement of each leg that it takes, m/N and 1/N.
    fn wrench_to_legs(&self) -> &[[Self::Real; 6]; LEGS];
    /// k_a Jᵀ at rest, its inverse: N/m and N.
    fn legs_to_wrench(&self) -> &[[Self::Real; LEGS]; 6];
    /// V⁻¹ K⁻¹ with K = Jᵀ k_a J: generalised force to the deflection it makes, in modal coordinates.
    fn force_to_modes(&self) -> &[[Self::Real; 6]; 6];
    /// V⁻¹ J⁻¹: leg displacements to modal coordinates.
    fn legs_to_modes(&self) -> &[[Self::Real; LEGS]; 6];
    /// J V: the modes as leg displacements.
    fn modes_to_legs(&self) -> &[[Self::Real; 6]; LEGS];
    /// The inverse dynamics.
    fn body(&self) -> &dynamics::Platform<Self::Real>;
    /// To first order the legs give way to inertia and gravity by P h + Q ḧ. None: by the whole kernel.
    fn affine_load(&self) -> Option<&Affine<Self::Real>>;
    /// Leg forces under which the gauges were zeroed: gravity at rest, N.
    fn rest_force(&self) -> &[Self::Real; LEGS];
    /// Largest |component| of the measured wrench that is believed, N and N m.
    fn wrench_limit(&self) -> &[Self::Real; 6];
    /// Lead of the leg displacements, in periods. Zero: none.
    fn lead(&self) -> Self::Real;
    /// Lead of each trajectory, in periods; empty where they have none of their own.
    fn own_leads(&self) -> &[Self::Real];
    /// Part of the offset of a change of mode that is left after a tick.
    fn transfer_keep(&self) -> Self::Real;
    /// Offset of a change of mode below which it is over, m.
    fn transfer_negligible(&self) -> Self::Real;
    /// 1/ρ̂ in cells of the Everett grid, 1/m.
    fn cells_per_metre(&self) -> Self::Real;
    /// ρ̂ in cells of the Everett grid, m.
    fn metres_per_cell(&self) -> Self::Real;
    /// Notch of each mode. Without one, modal coordinates are those of the pose.
    fn notch(&self) -> Option<&Notch<Self::Real>>;
    /// Active damping of each mode.
    fn damping(&self) -> &<Self::Damping as ModalDamping<Self::Real>>::Sections;
    /// Whether the integral is handed to the estimates when the set-point comes to rest.
    fn hands_over(&self) -> bool;
    /// How far and how fast the correction of each axis goes.
    fn correction(&self) -> &<Self::Correction as RequestCorrection<Self::Real>>::Limits;
    /// What each output line of the spec shows.
    fn lines(&self) -> &<Self::Lines as OutputLines<Self::Real>>::Settings;
    /// What the generator of set-points needs to know.
    fn setpoints(&self) -> &Setpoints<Self::Real, Self::Frames>;
    /// Where the gauges are.
    fn gauges(&self) -> &Gauges<'_, Self::Real>;
    /// Words to readings in m. Without it a word is a reading.
    fn calibration(&self) -> Option<&Self::Calibration>;
    /// First-order filter of the pose's rate.
    fn rate_filter(&self) -> &RateFilter<Self::Real>;
}
