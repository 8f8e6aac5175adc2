//! Codes of the gauges' converters.

use crate::ir::{GaugeConverter, Scalar, Sensing};
use crate::model::Model;

/// What converters of gauges with a calibration take in, V.
const VOLTS: [f64; 2] = [-10.0, 10.0];
/// A code is an `i32`: of a converter with more bits the targets drop the lowest.
const MOST_BITS: u32 = 31;

/// The converter's range is that of the gauge, or that of its voltage if there is a calibration.
pub(super) fn lower(model: &Model, sensing: Option<&Sensing>, scalar: Scalar) -> GaugeConverter {
    let calibrated = sensing.filter(|sensing| sensing.calibration.is_some());
    let [low, high] = if calibrated.is_some() { VOLTS } else { model.sensor.range };
    let bits = if model.sensor.bits > MOST_BITS { MOST_BITS } else { model.sensor.bits };
    let span = high - low;
    let believed = sensing.map_or(&[][..], |sensing| &sensing.raw_limits[..]);
    let lowest = believed.iter().fold(low, |lowest, limits| if limits[0] < lowest { limits[0] } else { lowest });
    let highest = believed.iter().fold(high, |highest, limits| if limits[1] > highest { limits[1] } else { highest });
    GaugeConverter {
        at_zero: scalar.round(low),
        per_code: scalar.round(span / libm::exp2(f64::from(bits))),
        highest: (((1_u64 << bits) - 1) & 0x7fff_ffff) as i32,
        beyond: [scalar.round(lowest - span), scalar.round(highest + span)],
    }
}
