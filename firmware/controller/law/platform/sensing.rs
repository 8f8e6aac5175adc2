//! Pose from six gauges that see the platform, and the filter of its rate.

pub use crate::gauges::{CALIBRATION, CONVERTER, GAUGES, RATE, RAW_LIMITS};

use crate::Real;
use crate::supervision::READINGS_PER_LEG;
use specgen_runtime::linear::component;
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

/// Word of each gauge (rows) per displacement of each leg (columns) near these words, per m: for a host that stands in for gauges.
#[must_use]
pub fn words_per_leg(raw: &[Real; 6]) -> [[Real; 6]; 6] {
    let mut rows = READINGS_PER_LEG;
    for (((row, raw_one), limits), gauge) in rows.iter_mut().zip(raw).zip(&RAW_LIMITS).zip(0..) {
        let step = (limits[1] - limits[0]) * 1e-3;
        let mut beside = *raw;
        beside[gauge] = *raw_one + step;
        let [here, there] = [readings(raw), readings(&beside)].map(|all| component(&all, gauge));
        for entry in row {
            *entry = *entry * step / (there - here);
        }
    }
    rows
}

/// Pose [x y z θx θy θz] from rest (m, rad) of gauge words without [`faults`]; finite for these.
#[inline]
#[must_use]
pub fn pose(raw: &[Real; 6]) -> [Real; 6] {
    GAUGES.pose(&readings(raw))
}
