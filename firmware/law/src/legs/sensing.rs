//! Readings of the legs' own gauges.

use super::constants::SixLegs;
use crate::spec::LEGS;

/// Word of each gauge (rows) per displacement of each leg (columns): for a host that stands in for gauges.
#[must_use]
pub fn words_per_leg<P: SixLegs>(p: P, _raw: &[P::Real; 6]) -> [[P::Real; 6]; 6] {
    *p.readings_per_leg()
}

/// A gauge reading is finite and within the gauges' range.
#[inline]
#[must_use]
pub fn gauge_is_accepted<P: SixLegs>(p: P, displacement: P::Real) -> bool {
    (p.gauge()[0]..=p.gauge()[1]).contains(&displacement)
}

/// Every leg set-point is finite and within the legs' range.
#[inline]
#[must_use]
pub fn leg_setpoint_is_accepted<P: SixLegs>(p: P, displacements: &[P::Real; LEGS]) -> bool {
    displacements.iter().all(|value| (p.leg_setpoint()[0]..=p.leg_setpoint()[1]).contains(value))
}

/// Gauges whose word is not believed: bit k for gauge k.
#[inline]
#[must_use]
pub fn faults<P: SixLegs>(p: P, displacements: &[P::Real; 6]) -> u32 {
    let mut faults = 0;
    for (index, reading) in displacements.iter().enumerate() {
        faults |= (!gauge_is_accepted(p, *reading) as u32) << index;
    }
    faults
}
