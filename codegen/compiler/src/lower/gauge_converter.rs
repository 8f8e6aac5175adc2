//! Codes of the gauges' converters.

use crate::figure::fixed;
use crate::ir::{GaugeConverter, Scalar, Sensing};
use specgen_language::diagnostic::{Diagnostic, Place, codes};
use specgen_language::model::Model;

/// Default of `sensor.input_range` for gauges with a calibration, V.
const VOLTS: [f64; 2] = [-10.0, 10.0];
/// Most bits of a code, which is an `i32`. The targets drop the lowest bits of a converter with more.
const MOST_BITS: u32 = 31;

/// Constants of the converter. Its range is that of the gauge, or that of the voltage if there is a calibration.
pub(super) fn lower(model: &Model, sensing: Option<&Sensing>, scalar: Scalar) -> GaugeConverter {
    let calibrated = sensing.filter(|sensing| sensing.calibration.is_some());
    let [low, high] = if calibrated.is_some() { model.sensor.input_range.unwrap_or(VOLTS) } else { model.sensor.range };
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

/// Findings about gauges whose voltage at rest is outside the range of the converter.
pub(super) fn unseen(model: &Model, sensing: Option<&Sensing>) -> Vec<Diagnostic> {
    let Some(Sensing { calibration: Some(of_gauge), raw_limits, .. }) = sensing else { return Vec::new() };
    let [low, high] = model.sensor.input_range.unwrap_or(VOLTS);
    let key = "sensor.input_range";
    let place = model.spans.get(key).or_else(|| model.spans.get("sensor.calibration"));
    let unseen = of_gauge.iter().zip(raw_limits).enumerate().filter(|(_, (coefficients, [first, last]))| {
        let reading = |volts: f64| coefficients.iter().rev().fold(0.0, |sum, c| c + volts * sum);
        let (from, to) = (if *first > low { *first } else { low }, if *last < high { *last } else { high });
        // Within the limits the polynomial is monotonic.
        from >= to || reading(from) * reading(to) > 0.0
    });
    let place = place.cloned().map_or(Place::Whole, Place::Spec);
    unseen
        .map(|(gauge, (_, [first, last]))| {
            let (from, to) = (fixed(*first, 4), fixed(*last, 4));
            let message = format!(
                "gauge {gauge} gives {from} V to {to} V over `sensor.range`, but its converter takes in {low} V to {high} V: it does not \
                 see the reading zero"
            );
            let (from, to) = (fixed(first - 1e-3, 3), fixed(last + 1e-3, 3));
            let help = format!(
                "write input_range = [\"{from} V\", \"{to} V\"] or wider, or check the calibration"
            );
            Diagnostic::new(codes::GAUGE_INPUT, key, place.clone(), message, help)
        })
        .collect()
}
