//! Constants of six legs that the law needs.

use super::lead::{DeadTimeLead, LastChange};
use crate::spec::Spec;

/// The law of six legs with their own gauges.
#[derive(Debug, Clone, Copy)]
pub struct LegSpace;

/// Constants of six legs, and the types of parts whose size depends on the spec.
pub trait SixLegs: Spec<Law = LegSpace> {
    /// Lead that compensates a leg's dead time, or none.
    type Lead: DeadTimeLead<Self::Real>;
    /// Last change of a leg's voltage, for the compensation of its resonance; or nothing.
    type Change: LastChange<Self::Real>;

    /// Lead of the leg displacements, ticks.
    fn lead(&self) -> Self::Real;
    /// Lag of the resonance, ticks.
    fn lag(&self) -> Self::Real;
    /// Addition to the demand over the second difference of the voltage, for the resonance.
    fn bend(&self) -> Self::Real;
    /// Relative growth of a leg's gain over the distance from the last turn, 1/m.
    fn gain_growth(&self) -> Self::Real;
    /// Largest lead, m.
    fn lead_limit(&self) -> Self::Real;
    /// Lowest and highest permitted set-point of a leg, m.
    fn leg_setpoint(&self) -> &[Self::Real; 2];
    /// ρ̂ of a leg, m/V.
    fn leg_gain(&self) -> Self::Real;
    /// Control period, s.
    fn period_seconds(&self) -> f64;
    /// Fraction of the approach's offset that is left after a tick.
    fn approach_keep(&self) -> Self::Real;
    /// Offset that counts as zero, m and rad.
    fn approach_negligible(&self) -> Self::Real;
}
