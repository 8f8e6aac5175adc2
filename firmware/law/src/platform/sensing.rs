//! Pose from six gauges that measure the platform, and the filter of its rate.

use specgen_runtime::linear::component;
use specgen_runtime::{GaugeCalibration as _, Real as _};

use super::constants::Platform;

/// Readings of the gauges, m, from their words.
#[inline]
#[must_use]
pub fn readings<P: Platform>(p: P, raw: &[P::Real; 6]) -> [P::Real; 6] {
    match p.calibration() {
        Some(calibration) => calibration.readings(raw),
        None => *raw,
    }
}

/// Word of each gauge (rows) per displacement of each leg (columns) near these words, per m. For a host that simulates
/// gauges.
#[must_use]
pub fn words_per_leg<P: Platform>(p: P, raw: &[P::Real; 6]) -> [[P::Real; 6]; 6] {
    let mut rows = *p.readings_per_leg();
    for (((row, raw_one), limits), gauge) in rows.iter_mut().zip(raw).zip(p.raw_limits()).zip(0..) {
        let step = (limits[1] - limits[0]) * P::Real::from_f64(1e-3);
        let mut beside = *raw;
        beside[gauge] = *raw_one + step;
        let [here, there] = [readings(p, raw), readings(p, &beside)].map(|all| component(&all, gauge));
        for entry in row {
            *entry = *entry * step / (there - here);
        }
    }
    rows
}

/// Pose [x y z θx θy θz] from rest (m, rad) from valid gauge words; finite.
#[inline]
#[must_use]
pub fn pose<P: Platform>(p: P, raw: &[P::Real; 6]) -> [P::Real; 6] {
    p.gauges().pose(&readings(p, raw))
}
