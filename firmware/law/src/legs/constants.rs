//! What the law has to know of six legs.

use super::lead::DeadTimeLead;
use crate::spec::Spec;

/// The law of six legs with their own gauges.
#[derive(Debug, Clone, Copy)]
pub struct LegSpace;

/// Constants of six legs, and the type of what has a size of its own.
pub trait SixLegs: Spec<Law = LegSpace> {
    /// What a leg is asked for ahead of its dead time, or none.
    type Lead: DeadTimeLead<Self::Real>;

    /// Lead of the leg displacements asked for, ticks.
    fn lead(&self) -> Self::Real;
    /// Most that it adds to a demand, m.
    fn lead_limit(&self) -> Self::Real;
    /// Lowest and highest displacement that is accepted as a set-point, m.
    fn leg_setpoint(&self) -> &[Self::Real; 2];
    /// ρ̂ of a leg, m/V.
    fn leg_gain(&self) -> Self::Real;
    /// Control period, s.
    fn period_seconds(&self) -> f64;
    /// What is left after a tick of the way to the set-point when the law begins.
    fn approach_keep(&self) -> Self::Real;
    /// A way this short, m and rad, is none.
    fn approach_negligible(&self) -> Self::Real;
}
