// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Pose from six gauges that see the platform, and the filter of its rate.

pub use crate::gauges::{CALIBRATION, CONVERTER, GAUGES, RATE, RAW_LIMITS};

use crate::Real;
use specgen_runtime::sensing;

/// Gauges whose word is not finite or out of [`RAW_LIMITS`]: bit k for gauge k.
#[inline]
#[must_use]
pub fn faults(raw: &[Real; 6]) -> u32 {
    sensing::faults(raw, &RAW_LIMITS)
}

/// Readings of the gauges, m, from their words.
#[inline]
#[must_use]
pub fn readings(raw: &[Real; 6]) -> [Real; 6] {
    match &CALIBRATION {
        Some(calibration) => calibration.readings(raw),
        None => *raw,
    }
}

/// Pose [x y z θx θy θz] from rest (m, rad) of gauge words without [`faults`]; finite for these.
#[inline]
#[must_use]
pub fn pose(raw: &[Real; 6]) -> [Real; 6] {
    GAUGES.pose(&readings(raw))
}
