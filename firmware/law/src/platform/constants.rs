//! Constants of a platform that the law needs.

use specgen_runtime::dynamics;
use specgen_runtime::setpoint::{Frames, Setpoints};
use specgen_runtime::trigger::OutputLines;
use specgen_runtime::{Affine, GaugeCalibration, Gauges, ModalDamping, Notch, RateFilter, RequestCorrection};

use crate::spec::{LEGS, Spec};

/// The law of a platform in task space.
#[derive(Debug, Clone, Copy)]
pub struct TaskSpace;

/// Constants of a platform in task space, and the types of parts whose size depends on the spec. There is one accessor
/// for each constant: with a single struct of all constants the compiler makes slower code.
pub trait Platform: Spec<Law = TaskSpace> {
    /// Active damping, or none.
    type Damping: ModalDamping<Self::Real>;
    /// Correction of the request, or none.
    type Correction: RequestCorrection<Self::Real>;
    /// Output lines, or none.
    type Lines: OutputLines<Self::Real>;
    /// The user's frames.
    type Frames: Frames<Self::Real>;
    /// Calibration of the gauges' words.
    type Calibration: GaugeCalibration<Self::Real>;

    /// T_s, s.
    fn period(&self) -> Self::Real;
    /// 1/k_a, m/N.
    fn compliance(&self) -> Self::Real;
    /// J⁻ᵀ/k_a at rest: from generalised force on the platform to leg displacements, m/N and 1/N.
    fn wrench_to_legs(&self) -> &[[Self::Real; 6]; LEGS];
    /// k_a Jᵀ at rest, its inverse: N/m and N.
    fn legs_to_wrench(&self) -> &[[Self::Real; LEGS]; 6];
    /// V⁻¹ K⁻¹ with K = Jᵀ k_a J: from generalised force to deflection, in modal coordinates.
    fn force_to_modes(&self) -> &[[Self::Real; 6]; 6];
    /// V⁻¹ J⁻¹: leg displacements to modal coordinates.
    fn legs_to_modes(&self) -> &[[Self::Real; LEGS]; 6];
    /// J V: the modes as leg displacements.
    fn modes_to_legs(&self) -> &[[Self::Real; 6]; LEGS];
    /// The inverse dynamics.
    fn body(&self) -> &dynamics::Platform<Self::Real>;
    /// First-order model of the legs' deflection under inertia and gravity, P h + Q ḧ, with their cross-talk. None: the
    /// full dynamics.
    fn affine_load(&self) -> Option<&Affine<Self::Real>>;
    /// E J, cross-talk of the legs beside the full dynamics: leg displacements (rows) per pose coordinate.
    fn cross_talk(&self) -> Option<&[[Self::Real; 6]; LEGS]>;
    /// Leg forces at which the gauges were zeroed: gravity at rest, N.
    fn rest_force(&self) -> &[Self::Real; LEGS];
    /// Largest valid |component| of the measured wrench, N and N m.
    fn wrench_limit(&self) -> &[Self::Real; 6];
    /// Lead of the leg displacements, in periods. Zero: none.
    fn lead(&self) -> Self::Real;
    /// Lead of each trajectory, in periods; empty if trajectories have no lead of their own.
    fn own_leads(&self) -> &[Self::Real];
    /// Fraction of the offset of a change of mode that is left after a tick.
    fn transfer_keep(&self) -> Self::Real;
    /// Offset of a change of mode that counts as zero, m.
    fn transfer_negligible(&self) -> Self::Real;
    /// 1/ρ̂ in cells of the Everett grid, 1/m.
    fn cells_per_metre(&self) -> Self::Real;
    /// ρ̂ in cells of the Everett grid, m.
    fn metres_per_cell(&self) -> Self::Real;
    /// Notch of each mode. Without one, modal coordinates are those of the pose.
    fn notch(&self) -> Option<&Notch<Self::Real>>;
    /// Active damping of each mode.
    fn damping(&self) -> &<Self::Damping as ModalDamping<Self::Real>>::Sections;
    /// Whether the integral is transferred to the estimates when the set-point comes to rest.
    fn hands_over(&self) -> bool;
    /// Limits of each axis's correction.
    fn correction(&self) -> &<Self::Correction as RequestCorrection<Self::Real>>::Limits;
    /// Function of each output line in the spec.
    fn lines(&self) -> &<Self::Lines as OutputLines<Self::Real>>::Settings;
    /// Constants of the set-point generator.
    fn setpoints(&self) -> &Setpoints<Self::Real, Self::Frames>;
    /// Positions of the gauges.
    fn gauges(&self) -> &Gauges<'_, Self::Real>;
    /// Words to readings in m. Without it a word is a reading.
    fn calibration(&self) -> Option<&Self::Calibration>;
    /// First-order filter of the pose's rate.
    fn rate_filter(&self) -> &RateFilter<Self::Real>;
}
