//! Readings of the legs' own gauges.

pub use crate::gauges::{CONVERTER, GAUGE, LEG_SETPOINT};

use crate::supervision::READINGS_PER_LEG;
use crate::{LEGS, Real};

/// Word of each gauge (rows) per displacement of each leg (columns): for a host that stands in for gauges.
#[must_use]
pub fn words_per_leg(_raw: &[Real; 6]) -> [[Real; 6]; 6] {
    READINGS_PER_LEG
}

/// A gauge reading is finite and within [`GAUGE`].
#[inline]
#[must_use]
pub fn gauge_is_accepted(displacement: Real) -> bool {
    (GAUGE[0]..=GAUGE[1]).contains(&displacement)
}

/// Every leg set-point is finite and within [`LEG_SETPOINT`].
#[inline]
#[must_use]
pub fn leg_setpoint_is_accepted(displacements: &[Real; LEGS]) -> bool {
    displacements.iter().all(|value| (LEG_SETPOINT[0]..=LEG_SETPOINT[1]).contains(value))
}
